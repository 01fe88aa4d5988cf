// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/exchange/surface_points.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "organbake/core/parallel.h"
#include "organbake/image/srgb.h"

namespace organbake {
namespace {

// A map shows a place when its depth there agrees to this many texels: skin seen at 80° falls off
// by 5.7 texels from one texel to the next, and half of that lies between centre and rim.
constexpr double kSamePlaceTexels = 3;

// The place that a texel shows.
Eigen::Vector3d place_of(const PosedCamera& camera, const CameraMaps& maps, std::size_t texel) {
  const Eigen::Vector2d pixel(texel % maps.width + 0.5, texel / maps.width + 0.5);
  return camera.camera_from_world.inverse() *
         (double(maps.depth_mm[texel]) * unproject(camera.intrinsics, pixel));
}

// One texel of each cell of a grid, over all cameras, in their order.
std::vector<SparsePoint> thinned(const Bundle& bundle, double spacing_mm) {
  std::vector<SparsePoint> points;
  std::set<std::array<std::int64_t, 3>> taken;
  for (std::size_t c = 0; c < bundle.maps.size(); ++c) {
    const CameraMaps& maps = bundle.maps[c];
    for (std::size_t i = 0; i < maps.face.size(); ++i) {
      if (maps.face[i] == kNoFace) continue;
      SparsePoint point;
      point.place_mm = place_of(bundle.cameras.cameras[c], maps, i);
      std::array<std::int64_t, 3> cell;
      for (int k = 0; k < 3; ++k)
        cell[k] = static_cast<std::int64_t>(std::floor(point.place_mm[k] / spacing_mm));
      if (!taken.insert(cell).second) continue;
      for (int k = 0; k < 3; ++k) point.srgb[k] = srgb8_from_linear(maps.color[i][k]);
      points.push_back(point);
    }
  }
  return points;
}

void see(const Bundle& bundle, SparsePoint& point) {
  for (std::uint32_t c = 0; c < bundle.maps.size(); ++c) {
    const CameraMaps& maps = bundle.maps[c];
    const PosedCamera& camera = bundle.cameras.cameras[c];
    const Eigen::Vector3d at = camera.camera_from_world * point.place_mm;
    if (!(at.z() > 0)) continue;
    const Eigen::Vector2d pixel = project(camera.intrinsics, at);
    if (!(pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < maps.width && pixel.y() < maps.height))
      continue;
    const std::size_t texel = std::size_t(pixel.y()) * maps.width + std::size_t(pixel.x());
    if (maps.face[texel] == kNoFace) continue;
    const double same_mm = kSamePlaceTexels * at.z() / camera.intrinsics.fx;
    if (std::abs(maps.depth_mm[texel] - at.z()) <= same_mm) point.seen.push_back({c, pixel});
  }
}

}  // namespace

std::vector<SparsePoint> surface_points(const Bundle& bundle, double spacing_mm, std::size_t most) {
  std::vector<SparsePoint> points = thinned(bundle, spacing_mm);
  // A surface has about a quarter of the points in cells twice as wide.
  while (points.size() > most) {
    spacing_mm *= std::max(1.02, std::sqrt(double(points.size()) / double(most)));
    points = thinned(bundle, spacing_mm);
  }
  parallel_for(std::size_t{0}, points.size(), [&](std::size_t p) { see(bundle, points[p]); });
  return points;
}

}  // namespace organbake
