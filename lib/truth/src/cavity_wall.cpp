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

#include "organbake/core/parallel.h"
#include "organbake/core/quantile.h"
#include "organbake/image/srgb.h"

namespace organbake {
namespace {

using Eigen::Array4f;
using Eigen::Vector3f;

struct WallSphere {
  Vector3f center;  // from the eye, world axes
  float radius;

  // How far along a ray its far side lies; negative where the ray misses it.
  float far_side(const Vector3f& ray) const {
    const float a = ray.squaredNorm(), b = ray.dot(center);
    const float discriminant = b * b - a * (center.squaredNorm() - radius * radius);
    return discriminant < 0 ? -1 : (b + std::sqrt(discriminant)) / a;
  }
};

// −1…1: folds some 50 mm apart that wind, and faint ones across them.
float folds_at(const Vector3f& p) {
  const float bend =
      2.2f * std::sin(0.031f * p.x() - 0.023f * p.z()) + 1.9f * std::sin(0.037f * p.y() + 1.9f);
  const float large = std::sin(0.083f * p.z() + 0.047f * p.x() + bend);
  const float small = std::sin(0.13f * p.y() - 0.09f * p.x() + 2.3f * bend + 1.5f * large);
  return 0.9f * large + 0.1f * small;
}

// Muscle and peritoneum, with yellow fat below it in places.
Vector3f wall_albedo(const Vector3f& p, float fold) {
  const Vector3f flesh(0.17f, 0.042f, 0.034f), fat(0.27f, 0.12f, 0.055f);
  const float patch = std::sin(0.031f * p.x() + 0.7f) * std::sin(0.027f * p.y() - 0.4f) +
                      0.5f * std::sin(0.05f * p.z() + 1.1f);
  const float share = std::clamp(0.9f * patch - 0.35f, 0.0f, 0.6f);
  return (flesh + share * (fat - flesh)) * (0.85f + 0.15f * fold);
}

// What skin is exposed for: the median of its depth, of every few pixels; 0 where none is there.
double exposed_range_mm(const DrawnScene& scene) {
  std::vector<float> depths;
  constexpr std::size_t kEvery = 997;
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
      : square_px_(std::clamp(scene.view.camera.intrinsics.width / 320, 1, 4)),
        step_px_(step_for(scene.view.camera.intrinsics)),
        columns_(scene.view.camera.intrinsics.width / step_px_ + 2),
        nodes_(std::size_t(columns_) * (scene.view.camera.intrinsics.height / step_px_ + 2)) {
    constexpr double kBehind_mm = 30, kFull = 0.75, kUnseen_mm = 100;
    for (int i = 0; i < 3 * kRun; ++i) behind_[i] = behind[i % 3];
    const Array4f unseen(behind[0], behind[1], behind[2], 0);
    const Eigen::Vector3d eye = scene.view.camera.center_world_mm();
    eye_ = eye.cast<float>();
    sphere_ = {(scene.organs.center() - eye).cast<float>(),
               static_cast<float>(0.75 * scene.organs.diagonal() + kBehind_mm)};
    const double range = exposed_range_mm(scene);
    full_mm2_ = static_cast<float>(kFull * std::pow(range > 0 ? range : kUnseen_mm, 2));
    parallel_for(0, static_cast<int>(nodes_.size()) / columns_, [&](int row) {
      for (int column = 0; column < columns_; ++column)
        nodes_[std::size_t(row) * columns_ + column] =
            seen_along(ray_through(scene.view.camera, column * step_px_, row * step_px_), unseen);
    });
  }

  int square_px() const { return square_px_; }

  // A row of squares of the frame as `picture` shows it: with the wall in those pixels that show
  // nothing and have the colour `behind`. Most lie in runs of nothing else.
  void paint_squares(int first_row, const Frame& frame, Rgb8Image& picture) const {
    const std::vector<std::uint8_t> colors = colors_of(first_row, picture.width);
    for (int y = first_row; y < std::min(first_row + square_px_, picture.height); ++y) {
      const Cover* const cover = &frame.cover[std::size_t(y) * picture.width];
      const std::uint8_t* const drawn = frame.color.at(0, y);
      std::uint8_t* const rgb = picture.at(0, y);
      for (int x = 0, run; x < picture.width; x += run) {
        run = std::min(kRun, picture.width - x);
        const bool wall = std::memcmp(cover + x, kNothing.data(), run) == 0 &&
                          std::memcmp(drawn + 3 * x, behind_.data(), 3 * run) == 0;
        std::memcpy(rgb + 3 * x, wall ? &colors[3 * x] : drawn + 3 * x, 3 * run);
        if (wall || !std::memchr(cover + x, int(Cover::background), run)) continue;
        for (int p = x; p < x + run; ++p)
          if (cover[p] == Cover::background &&
              std::equal(rgb + 3 * p, rgb + 3 * p + 3, behind_.begin()))
            std::copy_n(&colors[3 * p], 3, rgb + 3 * p);
      }
    }
  }

 private:
  // Whole squares, so many across the picture's shorter side.
  int step_for(const Intrinsics& lens) const {
    constexpr int kSteps = 18, kLeast_px = 4;
    const int step = std::max(kLeast_px, std::min(lens.width, lens.height) / kSteps);
    return step / square_px_ * square_px_;
  }

  // In world axes, through a pixel's middle.
  static Vector3f ray_through(const PosedCamera& camera, int x, int y) {
    return (camera.camera_from_world.rotation.transpose() *
            unproject(camera.intrinsics, {x + 0.5, y + 0.5}))
        .cast<float>();
  }

  // Of all pixels of a row of squares; four are written for each square, the last of which stay.
  std::vector<std::uint8_t> colors_of(int first_row, int width) const {
    constexpr int kWritten = 4;
    std::vector<std::uint8_t> colors(std::size_t(3) * (width + step_px_ + kWritten));
    const float down = float(first_row % step_px_) / float(step_px_);
    const Array4f* node = &nodes_[std::size_t(first_row / step_px_) * columns_];
    const auto at = [&](int column) -> Array4f {
      return node[column] + down * (node[column + columns_] - node[column]) + 0.5f;
    };
    for (int x = 0; x < width; ++node) {
      const Array4f step = float(square_px_) / float(step_px_) * (at(1) - at(0));
      Array4f color = at(0);
      for (const int end = x + step_px_; x < end; x += square_px_, color += step) {
        const Eigen::Array4i whole = color.cast<int>();
        const std::uint32_t rgb = whole[0] | whole[1] << 8 | whole[2] << 16;
        const std::uint32_t words[3] = {rgb | rgb << 24, rgb >> 8 | rgb << 16,
                                        rgb >> 16 | rgb << 8};
        std::memcpy(&colors[3 * x], words, sizeof words);
      }
    }
    return colors;
  }

  Array4f seen_along(const Vector3f& ray, const Array4f& behind) const {
    constexpr float kAmbient = 0.02f;  // of light that other tissue throws there
    const float along = sphere_.far_side(ray);
    if (!(along > 0)) return behind;
    const Vector3f away = along * ray, inward = (sphere_.center - away) / sphere_.radius;
    const float range2 = std::max(away.squaredNorm(), 1.0f);
    const float facing = std::max(0.0f, -inward.dot(away) / std::sqrt(range2));
    const float fold = folds_at(eye_ + away);
    const float light = full_mm2_ / range2 * facing * (0.85f + 0.15f * fold);
    const Vector3f color = (std::min(light, 1.0f) + kAmbient) * wall_albedo(eye_ + away, fold);
    return {float(srgb8_from_linear(color[0])), float(srgb8_from_linear(color[1])),
            float(srgb8_from_linear(color[2])), 0};
  }

  static constexpr int kRun = 64;  // pixels
  static constexpr auto kNothing = [] {
    std::array<Cover, kRun> run{};
    run.fill(Cover::background);
    return run;
  }();
  std::array<std::uint8_t, 3 * kRun> behind_;
  Vector3f eye_;
  WallSphere sphere_;
  float full_mm2_ = 0;
  int square_px_, step_px_;
  int columns_;
  std::vector<Array4f> nodes_;
};

}  // namespace

Bounds rest_bounds(const Player& player) {
  Bounds organs;
  for (std::size_t o = 0; o < player.organ_count(); ++o)
    for (const Eigen::Vector3d& vertex : player.bundle(o).proxy.vertices) organs.add(vertex);
  return organs;
}

void paint_cavity_wall(const DrawnScene& scene, const std::array<std::uint8_t, 3>& behind,
                       Rgb8Image& picture) {
  const WallLattice wall(scene, behind);
  picture.width = scene.frame.color.width, picture.height = scene.frame.color.height;
  picture.pixels.resize(scene.frame.color.pixels.size());
  const int side = wall.square_px();
  parallel_for(0, (picture.height + side - 1) / side,
               [&](int row) { wall.paint_squares(row * side, scene.frame, picture); });
}

}  // namespace organbake
