// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/exchange/map_sampler.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include "organbake/core/parallel.h"

namespace organbake {
namespace {

// A map shows a place when its depth agrees to this many texels (skin at 80° and half a texel on).
constexpr double kSameSkinTexels = 4;
// Neighbours farther apart in depth than this many texels are not one piece of skin.
constexpr double kJumpTexels = 6;
// A view from the front has finer texels than one from the side; this picks out the few best.
constexpr int kFrontness = 6;

Eigen::Vector3d texel_place(const PosedCamera& camera, const CameraMaps& maps, int x, int y) {
  return double(maps.depth_mm[std::size_t(y) * maps.width + x]) *
         unproject(camera.intrinsics, {x + 0.5, y + 0.5});
}

// By central differences of the places that the texels show, world axes; zero at rims.
std::vector<Eigen::Vector3f> normals_of(const PosedCamera& camera, const CameraMaps& maps) {
  std::vector<Eigen::Vector3f> normals(maps.face.size(), Eigen::Vector3f::Zero());
  const Eigen::Matrix3d world_from_camera = camera.camera_from_world.rotation.transpose();
  parallel_for(1, std::max(1, maps.height - 1), [&](int y) {
    for (int x = 1; x + 1 < maps.width; ++x) {
      const std::size_t i = std::size_t(y) * maps.width + x;
      const std::size_t round[] = {i, i - 1, i + 1, i - maps.width, i + maps.width};
      const double jump_mm = kJumpTexels * maps.depth_mm[i] / camera.intrinsics.fx;
      if (!std::all_of(std::begin(round), std::end(round), [&](std::size_t n) {
            return maps.face[n] != kNoFace &&
                   std::abs(maps.depth_mm[n] - maps.depth_mm[i]) <= jump_mm;
          }))
        continue;
      const Eigen::Vector3d across =
          texel_place(camera, maps, x + 1, y) - texel_place(camera, maps, x - 1, y);
      const Eigen::Vector3d down =
          texel_place(camera, maps, x, y + 1) - texel_place(camera, maps, x, y - 1);
      // With z forward across × down looks away from the camera.
      normals[i] = (world_from_camera * down.cross(across)).normalized().cast<float>();
    }
  });
  return normals;
}

}  // namespace

MapSampler::MapSampler(const Bundle& bundle) : bundle_(bundle) {
  std::vector<double> sizes;
  for (std::size_t c = 0; c < bundle.maps.size(); ++c) {
    const PosedCamera& camera = bundle.cameras.cameras[c];
    normals_.push_back(normals_of(camera, bundle.maps[c]));
    for (std::size_t i = 0; i < bundle.maps[c].face.size(); ++i)
      if (bundle.maps[c].face[i] != kNoFace)
        sizes.push_back(bundle.maps[c].depth_mm[i] / camera.intrinsics.fx);
  }
  if (sizes.empty()) return;
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  texel_mm_ = *middle;
}

std::optional<MapSample> MapSampler::at(const Eigen::Vector3d& place_mm,
                                        const Eigen::Vector3d& normal) const {
  Eigen::Vector3d color = Eigen::Vector3d::Zero(), mean_normal = Eigen::Vector3d::Zero();
  double weight = 0;
  for (std::size_t c = 0; c < bundle_.maps.size(); ++c) {
    const CameraMaps& maps = bundle_.maps[c];
    const PosedCamera& camera = bundle_.cameras.cameras[c];
    const Eigen::Vector3d p = camera.camera_from_world * place_mm;
    if (!(p.z() > 0)) continue;
    const double cosine = -(camera.camera_from_world.rotation * normal).dot(p.normalized());
    if (!(cosine > 0)) continue;
    const Eigen::Vector2d pixel = project(camera.intrinsics, p) - Eigen::Vector2d(0.5, 0.5);
    if (!(pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < maps.width - 1 &&
          pixel.y() < maps.height - 1))
      continue;
    const int x = static_cast<int>(pixel.x()), y = static_cast<int>(pixel.y());
    const double same_mm = kSameSkinTexels * p.z() / camera.intrinsics.fx;
    const double share = std::pow(cosine, kFrontness);
    for (int k = 0; k < 4; ++k) {
      const int dx = k % 2, dy = k / 2;
      const std::size_t i = std::size_t(y + dy) * maps.width + (x + dx);
      if (maps.face[i] == kNoFace || std::abs(maps.depth_mm[i] - p.z()) > same_mm) continue;
      const double fx = pixel.x() - x, fy = pixel.y() - y;
      const double w = share * maps.confidence[i] * (dx ? fx : 1 - fx) * (dy ? fy : 1 - fy);
      color += w * maps.color[i].cast<double>();
      mean_normal += w * normals_[c][i].cast<double>();
      weight += w;
    }
  }
  if (!(weight > 1e-9)) return std::nullopt;
  const double length = mean_normal.norm();
  return MapSample{(color / weight).cast<float>(),
                   length > 0 ? Eigen::Vector3d(mean_normal / length) : normal};
}

}  // namespace organbake
