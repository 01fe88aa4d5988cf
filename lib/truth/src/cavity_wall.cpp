// SPDX-License-Identifier: Apache-2.0
// The wall's folds are sine waves that bend each other (domain warping, Quilez 2002), without a
// seam. Its light falls off with the square of the range, from what skin in the middle of its
// depths is exposed for.
#include "organbake/truth/lens_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

#include "organbake/core/parallel.h"
#include "organbake/core/quantile.h"
#include "organbake/image/srgb.h"

namespace organbake {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

struct WallSphere {
  Vector3d center;  // from the eye, world axes
  double radius;

  // How far along a ray its far side lies; negative where the ray misses it.
  double far_side(const Vector3d& ray) const {
    const double a = ray.squaredNorm(), b = ray.dot(center);
    const double discriminant = b * b - a * (center.squaredNorm() - radius * radius);
    return discriminant < 0 ? -1 : (b + std::sqrt(discriminant)) / a;
  }
};

// −1…1: folds some 50 mm apart that wind, and faint ones across them.
double folds_at(const Vector3d& p) {
  const double bend =
      2.2 * std::sin(0.031 * p.x() - 0.023 * p.z()) + 1.9 * std::sin(0.037 * p.y() + 1.9);
  const double large = std::sin(0.083 * p.z() + 0.047 * p.x() + bend);
  const double small = std::sin(0.13 * p.y() - 0.09 * p.x() + 2.3 * bend + 1.5 * large);
  return 0.9 * large + 0.1 * small;
}

// Muscle and peritoneum, with yellow fat below it in places.
Vector3f wall_albedo(const Vector3d& p, double fold) {
  const Vector3f flesh(0.17f, 0.042f, 0.034f), fat(0.27f, 0.12f, 0.055f);
  const double patch = std::sin(0.031 * p.x() + 0.7) * std::sin(0.027 * p.y() - 0.4) +
                       0.5 * std::sin(0.05 * p.z() + 1.1);
  const auto share = static_cast<float>(std::clamp(0.9 * patch - 0.35, 0.0, 0.6));
  return (flesh + share * (fat - flesh)) * static_cast<float>(0.85 + 0.15 * fold);
}

// What skin is exposed for: the median of its depth, of every few pixels; 0 where none is there.
double exposed_range_mm(const DrawnScene& scene) {
  std::vector<float> depths;
  constexpr std::size_t kEvery = 241;
  for (std::size_t i = 0; i < scene.frame.depth_mm.size(); i += kEvery)
    if (std::isfinite(scene.frame.depth_mm[i])) depths.push_back(scene.frame.depth_mm[i]);
  return median(std::move(depths));
}

// The wall's colours, 0…255 in sRGB, at every few pixels, and between them in proportion: its folds
// are wider, by the picture's size. It is dim and blurred, so that small squares of a large picture
// have one colour each.
class WallLattice {
 public:
  WallLattice(const DrawnScene& scene, const std::array<std::uint8_t, 3>& behind)
      : step_px_(step_for(scene.view.camera.intrinsics)),
        square_px_(std::clamp(scene.view.camera.intrinsics.width / 320, 1, 4)),
        columns_(scene.view.camera.intrinsics.width / step_px_ + 2),
        nodes_(std::size_t(columns_) * (scene.view.camera.intrinsics.height / step_px_ + 2)) {
    constexpr double kBehind_mm = 30, kFull = 0.75, kUnseen_mm = 100;
    for (int i = 0; i < 3 * kRun; ++i) behind_[i] = behind[i % 3];
    const Vector3f unseen(behind[0], behind[1], behind[2]);
    eye_ = scene.view.camera.center_world_mm();
    sphere_ = {scene.organs.center() - eye_, 0.75 * scene.organs.diagonal() + kBehind_mm};
    const double range = exposed_range_mm(scene);
    full_mm2_ = kFull * (range > 0 ? range * range : kUnseen_mm * kUnseen_mm);
    parallel_for(0, static_cast<int>(nodes_.size()) / columns_, [&](int row) {
      for (int column = 0; column < columns_; ++column)
        nodes_[std::size_t(row) * columns_ + column] =
            seen_along(ray_through(scene.view.camera, column * step_px_, row * step_px_), unseen);
    });
  }

  int square_px() const { return square_px_; }

  // Paints those pixels of a row of squares that show nothing and have the colour `behind`: most
  // lie in runs of nothing else.
  void paint_squares(int first_row, const Frame& frame, Rgb8Image& picture) const {
    const std::vector<std::uint8_t> colors = colors_of(first_row, picture.width);
    for (int y = first_row; y < std::min(first_row + square_px_, picture.height); ++y) {
      const Cover* const cover = &frame.cover[std::size_t(y) * picture.width];
      std::uint8_t* const rgb = picture.at(0, y);
      for (int x = 0; x < picture.width; x += kRun) {
        if (x + kRun <= picture.width && std::memcmp(cover + x, kNothing.data(), kRun) == 0 &&
            std::memcmp(rgb + 3 * x, behind_.data(), 3 * kRun) == 0) {
          std::copy_n(&colors[3 * x], 3 * kRun, rgb + 3 * x);
          continue;
        }
        for (int p = x; p < std::min(x + kRun, picture.width); ++p)
          if (cover[p] == Cover::background &&
              std::equal(rgb + 3 * p, rgb + 3 * p + 3, behind_.begin()))
            std::copy_n(&colors[3 * p], 3, rgb + 3 * p);
      }
    }
  }

 private:
  static int step_for(const Intrinsics& lens) {
    constexpr int kSteps = 18, kLeast_px = 4;  // across the picture's shorter side
    return std::max(kLeast_px, std::min(lens.width, lens.height) / kSteps);
  }

  // In world axes, through a pixel's middle.
  static Vector3d ray_through(const PosedCamera& camera, int x, int y) {
    return camera.camera_from_world.rotation.transpose() *
           unproject(camera.intrinsics, {x + 0.5, y + 0.5});
  }

  // Of all pixels of a row of squares.
  std::vector<std::uint8_t> colors_of(int first_row, int width) const {
    std::vector<std::uint8_t> colors(std::size_t(3) * width);
    const float down = float(first_row % step_px_) / float(step_px_);
    const Vector3f* const nodes = &nodes_[std::size_t(first_row / step_px_) * columns_];
    for (int x = 0; x < width; x += square_px_) {
      const float across = float(x) / float(step_px_);
      const Vector3f* const node = nodes + static_cast<int>(across);
      const Vector3f left = node[0] + down * (node[columns_] - node[0]);
      const Vector3f right = node[1] + down * (node[columns_ + 1] - node[1]);
      const Vector3f color = left + (across - std::floor(across)) * (right - left);
      const std::array<std::uint8_t, 3> rounded = {static_cast<std::uint8_t>(color[0] + 0.5f),
                                                   static_cast<std::uint8_t>(color[1] + 0.5f),
                                                   static_cast<std::uint8_t>(color[2] + 0.5f)};
      for (int p = x; p < std::min(x + square_px_, width); ++p)
        std::copy_n(rounded.begin(), 3, &colors[3 * p]);
    }
    return colors;
  }

  Vector3f seen_along(const Vector3d& ray, const Vector3f& behind) const {
    constexpr float kAmbient = 0.02f;  // of light that other tissue throws there
    const double along = sphere_.far_side(ray);
    if (!(along > 0)) return behind;
    const Vector3d away = along * ray, inward = (sphere_.center - away) / sphere_.radius;
    const double range2 = std::max(away.squaredNorm(), 1.0);
    const double facing = std::max(0.0, -inward.dot(away) / std::sqrt(range2));
    const double fold = folds_at(eye_ + away);
    const auto light = static_cast<float>(full_mm2_ / range2 * facing * (0.85 + 0.15 * fold));
    const Vector3f color = (std::min(light, 1.0f) + kAmbient) * wall_albedo(eye_ + away, fold);
    return 255 * color.unaryExpr([](float c) { return srgb_from_linear(std::min(c, 1.0f)); });
  }

  static constexpr int kRun = 16;  // pixels
  static constexpr auto kNothing = [] {
    std::array<Cover, kRun> run{};
    run.fill(Cover::background);
    return run;
  }();
  std::array<std::uint8_t, 3 * kRun> behind_;
  Vector3d eye_;
  WallSphere sphere_;
  double full_mm2_ = 0;
  int step_px_, square_px_;
  int columns_;
  std::vector<Vector3f> nodes_;
};

}  // namespace

Bounds rest_bounds(const Player& player) {
  Bounds organs;
  for (std::size_t o = 0; o < player.organ_count(); ++o)
    for (const Vector3d& vertex : player.bundle(o).proxy.vertices) organs.add(vertex);
  return organs;
}

void paint_cavity_wall(const DrawnScene& scene, const std::array<std::uint8_t, 3>& behind,
                       Rgb8Image& picture) {
  const WallLattice wall(scene, behind);
  const int side = wall.square_px();
  parallel_for(0, (picture.height + side - 1) / side,
               [&](int row) { wall.paint_squares(row * side, scene.frame, picture); });
}

}  // namespace organbake
