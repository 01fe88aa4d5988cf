// SPDX-License-Identifier: GPL-3.0-or-later
// A bundle's surface at rest for those who take it elsewhere: its base layer as one mesh, what its
// maps show at a place of it, and points spread over it with the cameras that see them.
#include "organbake/exchange/exchange.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/core/quantile.h"
#include "organbake/geometry/smooth_skin.h"
#include "organbake/image/srgb.h"

namespace organbake {
namespace {

// A map shows a place when its depth agrees to this many texels (skin at 80° and half a texel on).
constexpr double kSameSkinTexels = 4;
// Neighbours farther apart in depth than this many texels are not one piece of skin.
constexpr double kJumpTexels = 6;
// A view from the front has finer texels than one from the side; this picks out the few best.
constexpr int kFrontness = 6;

// The place that a texel shows, in the camera's axes.
Eigen::Vector3d texel_place(const PosedCamera& camera, const CameraMaps& maps, std::size_t texel) {
  const Eigen::Vector2d pixel(texel % maps.width + 0.5, texel / maps.width + 0.5);
  return double(maps.depth_mm[texel]) * unproject(camera.intrinsics, pixel);
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
          texel_place(camera, maps, i + 1) - texel_place(camera, maps, i - 1);
      const Eigen::Vector3d down =
          texel_place(camera, maps, i + maps.width) - texel_place(camera, maps, i - maps.width);
      // With z forward across × down looks away from the camera.
      normals[i] = (world_from_camera * down.cross(across)).normalized().cast<float>();
    }
  });
  return normals;
}

// A map shows a place when its depth there agrees to this many texels: skin seen at 80° falls off
// by 5.7 texels from one texel to the next, and half of that lies between centre and rim.
constexpr double kSamePlaceTexels = 3;

// One texel of each cell of a grid, over all cameras, in their order.
std::vector<SparsePoint> thinned(const Bundle& bundle, double spacing_mm) {
  std::vector<SparsePoint> points;
  std::set<std::array<std::int64_t, 3>> taken;
  for (std::size_t c = 0; c < bundle.maps.size(); ++c) {
    const CameraMaps& maps = bundle.maps[c];
    for (std::size_t i = 0; i < maps.face.size(); ++i) {
      if (maps.face[i] == kNoFace) continue;
      SparsePoint point;
      const PosedCamera& camera = bundle.cameras.cameras[c];
      point.place_mm = camera.camera_from_world.inverse() * texel_place(camera, maps, i);
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

TriangleMesh base_surface(const Bundle& bundle) {
  const BaseLayer& base = bundle.base;
  const ShellSurface shell = bundle.shell();
  const TriangleMesh& at_rest = shell.at_rest();
  if (base.steps < 1 || base.face_count != at_rest.faces.size() ||
      base.height_mm.size() != std::size_t(base.face_count) * base.nodes_per_face() ||
      base.color.size() != base.height_mm.size())
    throw BadDataError("base layer: is not of this bundle's proxy");
  const std::uint32_t n = base.steps;
  const Lattice lattice(at_rest, n);
  const std::vector<Lattice::ShellLine> lines = lattice.shell_lines();
  TriangleMesh mesh;
  mesh.vertices.resize(lattice.node_count());
  mesh.colors.resize(lattice.node_count());
  for (std::uint32_t face = 0; face < base.face_count; ++face) {
    const auto at = [&](std::uint32_t i, std::uint32_t j) { return lattice.node(face, i, j); };
    each_node(n, [&](std::uint32_t i, std::uint32_t j, std::uint32_t node) {
      const std::size_t stored = std::size_t(face) * base.nodes_per_face() + node;
      const Lattice::ShellLine& line = lines[at(i, j)];
      mesh.vertices[at(i, j)] = line.foot + double(base.height_mm[stored]) * line.direction;
      mesh.colors[at(i, j)] = base.color[stored];
      if (i + j < n) mesh.faces.push_back({at(i, j), at(i + 1, j), at(i, j + 1)});
      if (i + j + 1 < n) mesh.faces.push_back({at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
    });
  }
  return mesh;
}

MapSampler::MapSampler(const Bundle& bundle) : bundle_(bundle) {
  std::vector<double> sizes;
  for (std::size_t c = 0; c < bundle.maps.size(); ++c) {
    const PosedCamera& camera = bundle.cameras.cameras[c];
    normals_.push_back(normals_of(camera, bundle.maps[c]));
    for (std::size_t i = 0; i < bundle.maps[c].face.size(); ++i)
      if (bundle.maps[c].face[i] != kNoFace)
        sizes.push_back(bundle.maps[c].depth_mm[i] / camera.intrinsics.fx);
  }
  if (!sizes.empty()) texel_mm_ = median(std::move(sizes));
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
