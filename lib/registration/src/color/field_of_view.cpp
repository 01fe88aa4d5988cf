// SPDX-License-Identifier: GPL-3.0-or-later
#include "appearance/photo_pyramid.h"

#include <Eigen/Core>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace organbake {
namespace {

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

// Algebraic circle fit (Kåsa 1976).
Circle fit_circle(const std::vector<Vector2d>& points) {
  Eigen::MatrixXd a(points.size(), 3);
  Eigen::VectorXd b(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    a.row(i) << points[i].x(), points[i].y(), 1;
    b[i] = points[i].squaredNorm();
  }
  const Vector3d s = a.colPivHouseholderQr().solve(b);
  const Vector2d center = s.head<2>() / 2;
  return {center, std::sqrt(std::max(0.0, s[2] + center.squaredNorm()))};
}

std::optional<Circle> round_field(const Rgb8Image& photo) {
  std::vector<Vector2d> ends;
  for (int i = 0; i < kDirections; ++i) {
    const auto end = border_end(photo, 2 * std::numbers::pi * i / kDirections);
    if (end) ends.push_back(*end);
  }
  if (ends.size() < kLeastBorder) return std::nullopt;
  const Circle circle = fit_circle(ends);
  const double least = kLeastRadius * std::min(photo.width, photo.height);
  if (!(circle.radius > least) || circle.radius > photo.width + photo.height) return std::nullopt;
  const auto on_circle = std::count_if(ends.begin(), ends.end(), [&](const Vector2d& end) {
    return std::abs((end - circle.center).norm() - circle.radius) < kOffCircle * circle.radius + 1;
  });
  if (on_circle < kLeastShare * static_cast<double>(ends.size())) return std::nullopt;
  return circle;
}

}  // namespace

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
