// SPDX-License-Identifier: GPL-3.0-or-later
// A photograph's pyramid of linear luminance and of the pixels that count: not blown out, nor in
// the black border, which is found as a circle (Kåsa's fit, 1976) and not by its colour, for
// backgrounds are black, too.
#include "appearance/prediction.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "organbake/core/parallel.h"
#include "organbake/geometry/dense_solve.h"
#include "organbake/image/srgb.h"

namespace organbake {
namespace {

constexpr int kBlown = 250;    // 8-bit: what a clipped highlight still has after compression
constexpr int kLeastSide = 8;  // pixels: below, nothing can be told

bool is_blown(const std::uint8_t* rgb) { return std::max({rgb[0], rgb[1], rgb[2]}) >= kBlown; }

// Lens and compression spread a blown pixel over its neighbours.
void drop_blown(const Rgb8Image& photo, std::vector<std::uint8_t>& valid) {
  for (int y = 0; y < photo.height; ++y)
    for (int x = 0; x < photo.width; ++x) {
      if (!is_blown(photo.at(x, y))) continue;
      for (int v = std::max(0, y - 1); v <= std::min(photo.height - 1, y + 1); ++v)
        for (int u = std::max(0, x - 1); u <= std::min(photo.width - 1, x + 1); ++u)
          valid[std::size_t(v) * photo.width + u] = 0;
    }
}

PhotoLevel first_level(const Rgb8Image& photo, const Rgb8Image& mask) {
  PhotoLevel level;
  level.luminance.resize(photo.pixels.size() / 3);
  const auto& linear = linear_from_srgb8();
  for (std::size_t i = 0; i < level.luminance.size(); ++i) {
    const std::uint8_t* rgb = &photo.pixels[3 * i];
    level.luminance[i] = luminance(linear[rgb[0]], linear[rgb[1]], linear[rgb[2]]);
  }
  level.valid = valid_pixels(photo, mask);
  return level;
}

// A pixel counts when at least two of its four do; its value is their mean.
PhotoLevel halved(const PhotoLevel& fine, const Intrinsics& intrinsics) {
  PhotoLevel half;
  half.factor = 2 * fine.factor;
  half.intrinsics = reduced(intrinsics, half.factor);
  const int width = half.intrinsics.width, height = half.intrinsics.height;
  half.luminance.resize(std::size_t(width) * height);
  half.valid.resize(half.luminance.size());
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const std::size_t top = fine.index(2 * x, 2 * y), bottom = fine.index(2 * x, 2 * y + 1);
      float sum = 0;
      int count = 0;
      for (const std::size_t i : {top, top + 1, bottom, bottom + 1}) {
        count += fine.valid[i];
        sum += fine.valid[i] ? fine.luminance[i] : 0;
      }
      half.luminance[half.index(x, y)] = count > 0 ? sum / count : 0;
      half.valid[half.index(x, y)] = count >= 2;
    }
  return half;
}

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kDirections = 180;
constexpr int kBlackBorder = 12;               // 8-bit: no channel brighter
constexpr double kLeastRadius = 0.4;           // of the shorter side: fields of view are large
constexpr double kOffCircle = 0.01;            // of the radius
constexpr double kLeastShare = 0.7;            // of the border's directions lie on the circle
constexpr int kLeastBorder = kDirections / 6;  // directions in which a border is seen at all
constexpr double kInset = 3;                   // pixels: the border's blur

struct Circle {
  Vector2d center;
  double radius;
};

bool is_black(const Rgb8Image& photo, int x, int y) {
  const std::uint8_t* rgb = photo.at(x, y);
  return std::max({rgb[0], rgb[1], rgb[2]}) <= kBlackBorder;
}

// Where the picture stops being black on the way from its edge to the centre; nothing when it is
// not black at the edge.
std::optional<Vector2d> border_end(const Rgb8Image& photo, double angle) {
  const Vector2d middle(photo.width / 2.0, photo.height / 2.0);
  const Vector2d direction(std::cos(angle), std::sin(angle));
  const double to_edge =
      std::min((photo.width / 2.0 - 1) / std::max(1e-9, std::abs(direction.x())),
               (photo.height / 2.0 - 1) / std::max(1e-9, std::abs(direction.y())));
  for (double r = to_edge; r > 0; --r) {
    const Vector2d at = middle + r * direction;
    if (is_black(photo, static_cast<int>(at.x()), static_cast<int>(at.y()))) continue;
    return r > to_edge - 2 ? std::nullopt : std::optional(at);
  }
  return std::nullopt;
}

// Algebraic circle fit (Kåsa 1976). Nothing for points of one line.
std::optional<Circle> fit_circle(const std::vector<Vector2d>& points) {
  Eigen::MatrixXd a(points.size(), 3);
  Eigen::VectorXd b(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    a.row(i) << points[i].x(), points[i].y(), 1;
    b[i] = points[i].squaredNorm();
  }
  const auto s = solve_least_squares(a, b);
  if (!s) return std::nullopt;
  const Vector2d center = s->head<2>() / 2;
  return Circle{center, std::sqrt(std::max(0.0, (*s)[2] + center.squaredNorm()))};
}

std::optional<Circle> round_field(const Rgb8Image& photo) {
  std::vector<Vector2d> ends;
  for (int i = 0; i < kDirections; ++i) {
    const auto end = border_end(photo, 2 * std::numbers::pi * i / kDirections);
    if (end) ends.push_back(*end);
  }
  if (ends.size() < kLeastBorder) return std::nullopt;
  const auto circle = fit_circle(ends);
  if (!circle) return std::nullopt;
  const double least = kLeastRadius * std::min(photo.width, photo.height);
  if (!(circle->radius > least) || circle->radius > photo.width + photo.height) return std::nullopt;
  const auto on_circle = std::count_if(ends.begin(), ends.end(), [&](const Vector2d& end) {
    return std::abs((end - circle->center).norm() - circle->radius) <
           kOffCircle * circle->radius + 1;
  });
  if (on_circle < kLeastShare * static_cast<double>(ends.size())) return std::nullopt;
  return circle;
}

}  // namespace

std::vector<std::uint8_t> pixels_in_field(const Rgb8Image& photo, const Rgb8Image& mask) {
  std::vector<std::uint8_t> valid = inside_round_field(photo);
  for (std::size_t i = 0; 3 * i < mask.pixels.size(); ++i) {
    const std::uint8_t* rgb = &mask.pixels[3 * i];
    if (rgb[0] + rgb[1] + rgb[2] < 3 * 128) valid[i] = 0;
  }
  return valid;
}

std::vector<std::uint8_t> valid_pixels(const Rgb8Image& photo, const Rgb8Image& mask) {
  std::vector<std::uint8_t> valid = pixels_in_field(photo, mask);
  drop_blown(photo, valid);
  return valid;
}

std::vector<Eigen::Vector3f> pixel_rays(const Intrinsics& intrinsics) {
  std::vector<Eigen::Vector3f> rays(std::size_t(intrinsics.width) * intrinsics.height);
  parallel_for(0, intrinsics.height, [&](int y) {
    for (int x = 0; x < intrinsics.width; ++x)
      rays[std::size_t(y) * intrinsics.width + x] =
          unproject(intrinsics, {x + 0.5, y + 0.5}).cast<float>();
  });
  return rays;
}

std::vector<PhotoLevel> photo_pyramid(const Rgb8Image& photo, const Rgb8Image& mask,
                                      const Intrinsics& intrinsics, int finest_side,
                                      int coarsest_side) {
  std::vector<PhotoLevel> levels;
  PhotoLevel level = first_level(photo, mask);
  level.intrinsics = intrinsics;
  while (std::min(level.intrinsics.width, level.intrinsics.height) >= kLeastSide) {
    const int side = std::max(level.intrinsics.width, level.intrinsics.height);
    if (side <= finest_side) levels.push_back(level);
    if (side <= coarsest_side) break;
    level = halved(level, intrinsics);
  }
  for (PhotoLevel& kept : levels) kept.rays = pixel_rays(kept.intrinsics);
  return levels;
}

std::vector<std::uint8_t> inside_round_field(const Rgb8Image& photo) {
  std::vector<std::uint8_t> inside(std::size_t(photo.width) * photo.height, 1);
  const auto circle = round_field(photo);
  if (!circle) return inside;
  const double radius2 = std::pow(circle->radius - kInset, 2);
  for (int y = 0; y < photo.height; ++y)
    for (int x = 0; x < photo.width; ++x)
      inside[std::size_t(y) * photo.width + x] =
          (Vector2d(x + 0.5, y + 0.5) - circle->center).squaredNorm() < radius2;
  return inside;
}

}  // namespace organbake
