// SPDX-License-Identifier: GPL-3.0-or-later
// What a bundle's cameras see, freed from the ground: the maps' colours and depths, with the
// outline of the base layer by 16 rays a pixel; out as pictures with alpha, masks and depths (PNG).
#include "organbake/exchange/exchange.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "organbake/core/parallel.h"
#include "organbake/image/png.h"
#include "organbake/image/srgb.h"

namespace organbake {
namespace {

constexpr int kRaysPerSide = 4;  // alpha in 1/16

class CutOutPainter {
 public:
  CutOutPainter(const CameraMaps& maps, const PosedCamera& camera, const TriangleMesh& base,
                const RayScene& scene)
      : maps_(maps),
        camera_(camera),
        world_from_camera_(camera.camera_from_world.inverse()),
        base_(base),
        scene_(scene),
        centers_(std::size_t(maps.width) * maps.height) {
    picture_.color = Rgb8Image(maps.width, maps.height);
    picture_.alpha.assign(centers_.size(), 0);
    picture_.depth_mm.assign(centers_.size(), 0);
  }

  CutOut run() {
    parallel_for(0, maps_.height, [&](int y) {
      std::vector<Ray> rays;
      for (int x = 0; x < maps_.width; ++x) rays.push_back(ray(x + 0.5, y + 0.5));
      scene_.first_hits(rays, {&centers_[index(0, y)], rays.size()});
    });
    parallel_for(0, maps_.height, [&](int y) {
      for (int x = 0; x < maps_.width; ++x) paint(x, y);
    });
    return std::move(picture_);
  }

 private:
  std::size_t index(int x, int y) const { return std::size_t(y) * maps_.width + x; }

  Ray ray(double x, double y) const {
    return {world_from_camera_.translation,
            world_from_camera_.rotation * unproject(camera_.intrinsics, {x, y})};
  }
  Eigen::Vector3f color_at(const RayHit& hit) const {
    const auto& [a, b, c] = base_.faces[hit.face];
    return (1 - hit.u - hit.v) * base_.colors[a] + hit.u * base_.colors[b] +
           hit.v * base_.colors[c];
  }

  bool at_outline(int x, int y) const {
    const bool inside = centers_[index(x, y)].face != kNoHit;
    for (int j = std::max(0, y - 1); j <= std::min(maps_.height - 1, y + 1); ++j)
      for (int i = std::max(0, x - 1); i <= std::min(maps_.width - 1, x + 1); ++i)
        if ((centers_[index(i, j)].face != kNoHit) != inside) return true;
    return false;
  }

  void paint(int x, int y) {
    const std::size_t i = index(x, y);
    const RayHit& center = centers_[i];
    Eigen::Vector3f color = Eigen::Vector3f::Zero();
    double covered = 0;
    if (at_outline(x, y)) {
      const auto hits = fine_hits(x, y);
      for (const RayHit& hit : hits) {
        if (hit.face == kNoHit) continue;
        color += color_at(hit);
        ++covered;
      }
      if (covered > 0) color /= static_cast<float>(covered);
      covered /= static_cast<double>(hits.size());
    } else if (center.face != kNoHit) {
      color = color_at(center);
      covered = 1;
    }
    if (maps_.face[i] != kNoFace) {
      color = maps_.color[i];
      picture_.depth_mm[i] = maps_.depth_mm[i];
    } else if (center.face != kNoHit) {
      picture_.depth_mm[i] = static_cast<float>(center.t);
    }
    picture_.alpha[i] = static_cast<std::uint8_t>(std::lround(255 * covered));
    if (picture_.alpha[i] == 0) return;
    for (int k = 0; k < 3; ++k) picture_.color.pixels[3 * i + k] = srgb8_from_linear(color[k]);
  }

  std::array<RayHit, kRaysPerSide * kRaysPerSide> fine_hits(int x, int y) const {
    std::array<Ray, kRaysPerSide * kRaysPerSide> rays;
    for (int r = 0; r < kRaysPerSide * kRaysPerSide; ++r)
      rays[r] = ray(x + (r % kRaysPerSide + 0.5) / kRaysPerSide,
                    y + (r / kRaysPerSide + 0.5) / kRaysPerSide);
    std::array<RayHit, kRaysPerSide * kRaysPerSide> hits;
    scene_.first_hits(rays, hits);
    return hits;
  }

  const CameraMaps& maps_;
  const PosedCamera& camera_;
  RigidTransform world_from_camera_;
  const TriangleMesh& base_;
  const RayScene& scene_;
  std::vector<RayHit> centers_;
  CutOut picture_;
};

}  // namespace

CutOut cut_out(const CameraMaps& maps, const PosedCamera& camera, const TriangleMesh& base,
               const RayScene& scene) {
  return CutOutPainter(maps, camera, base, scene).run();
}

std::string mask_png(const CutOut& picture) {
  std::vector<std::uint8_t> mask;
  for (const std::uint8_t alpha : picture.alpha) mask.push_back(alpha >= 128 ? 255 : 0);
  return encode_grey_png(picture.color.width, picture.color.height, mask);
}

std::string depth_png(const CutOut& picture, double unit_mm) {
  std::vector<std::uint16_t> counts;
  constexpr double kMost = std::numeric_limits<std::uint16_t>::max();
  for (const float depth_mm : picture.depth_mm)
    counts.push_back(
        static_cast<std::uint16_t>(std::clamp(std::round(depth_mm / unit_mm), 0.0, kMost)));
  return encode_grey_png(picture.color.width, picture.color.height, counts);
}

double depth_unit_mm(double largest_depth_mm) {
  const double least = largest_depth_mm / std::numeric_limits<std::uint16_t>::max();
  if (!(least > 0)) return 1;
  const double decade = std::pow(10, std::floor(std::log10(least)));
  for (const double step : {1.0, 2.0, 5.0})
    if (step * decade >= least) return step * decade;
  return 10 * decade;
}

}  // namespace organbake
