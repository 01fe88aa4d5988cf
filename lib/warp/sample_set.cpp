// SPDX-License-Identifier: Apache-2.0
#include "warp/sample_set.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <bit>
#include <cmath>

#include "core/error.h"
#include "warp/texel_detail.h"
#include "warp/texel_order.h"

namespace organbake {
namespace {

// Everything that the pieces of one map share while it is bound.
struct MapBinder {
  const CameraMaps& maps;
  const PosedCamera& camera;
  const std::vector<ShellMatrix>& rest;
  MapNeighbours neighbours;

  Eigen::Vector3d ray(double u, double v) const {
    const Intrinsics& k = camera.intrinsics;
    if (k.has_distortion()) return unproject(k, {u, v});
    return {(u - k.cx) / k.fx, (v - k.cy) / k.fy, 1.0};
  }
  Eigen::Vector3d texel_ray(std::uint32_t texel) const {
    return ray(texel % maps.width + 0.5, static_cast<double>(texel / maps.width) + 0.5);
  }
};

// Depth over one run as a plane in (u, v), by least squares drawn gently towards the proxy face's
// own slope, which alone decides for a run of one texel.
struct DepthPlane {
  Eigen::Vector2d center;  // (u, v), texel centres
  double depth = 0;
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
};

Eigen::Vector2d face_slope(const MapBinder& map, const ShellMatrix& m, const Eigen::Vector2d& at,
                           double depth) {
  const Eigen::Vector3d n = Eigen::Vector3d(m.col(1)).cross(Eigen::Vector3d(m.col(2)));
  const Eigen::Vector3d r = map.ray(at.x(), at.y());
  const double facing = n.dot(r), steepest = 4 * depth / map.camera.intrinsics.fx;
  Eigen::Vector2d slope(-n.dot(map.ray(at.x() + 1, at.y()) - r),
                        -n.dot(map.ray(at.x(), at.y() + 1) - r));
  slope *= depth / (std::abs(facing) > 1e-12 ? facing : 1e-12);
  return slope.cwiseMax(-steepest).cwiseMin(steepest);
}

DepthPlane fit_depth(const MapBinder& map, const TexelOrder& order, const TexelRun& run) {
  DepthPlane plane{.center = Eigen::Vector2d::Zero()};
  const auto each = [&](auto&& visit) {
    for (std::uint32_t i = run.first; i < run.first + run.count; ++i) {
      const std::uint32_t t = order.texels[i];
      visit(Eigen::Vector2d(t % map.maps.width + 0.5, double(t / map.maps.width) + 0.5),
            double(map.maps.depth_mm[t]));
    }
  };
  each([&](const Eigen::Vector2d& at, double z) { plane.center += at, plane.depth += z; });
  plane.center /= run.count;
  plane.depth /= run.count;
  const Eigen::Vector2d prior = face_slope(map, map.rest[run.face], plane.center, plane.depth);
  constexpr double kPriorWeight = 0.5;  // texels²: as much as one neighbour pair says
  Eigen::Matrix2d normal = kPriorWeight * Eigen::Matrix2d::Identity();
  Eigen::Vector2d right = kPriorWeight * prior;
  each([&](const Eigen::Vector2d& at, double z) {
    const Eigen::Vector2d d = at - plane.center;
    normal += d * d.transpose();
    right += d * (z - plane.depth);
  });
  plane.slope = normal.inverse() * right;
  return plane;
}

// How the surface moves per texel in shell coordinates: the camera's ray derivative along the
// fitted plane, through the inverse of the shell map's Jacobian.
void set_tangents(const MapBinder& map, const DepthPlane& plane, Patch& patch) {
  const ShellMatrix& m = map.rest[patch.face];
  const double b1 = patch.center[0], b2 = patch.center[1], h = patch.center[2];
  Eigen::Matrix3d shell;
  shell << m.col(1) + h * m.col(4), m.col(2) + h * m.col(5),
      m.col(3) + b1 * m.col(4) + b2 * m.col(5);
  const Eigen::Vector3d r = map.ray(plane.center.x(), plane.center.y());
  const Eigen::Vector3d r_u = map.ray(plane.center.x() + 1, plane.center.y()) - r;
  const Eigen::Vector3d r_v = map.ray(plane.center.x(), plane.center.y() + 1) - r;
  Eigen::Matrix<double, 3, 2> surface;
  surface << plane.depth * r_u + plane.slope.x() * r, plane.depth * r_v + plane.slope.y() * r;
  const Eigen::Matrix<double, 3, 2> tangents = shell.inverse() * surface;
  if (!tangents.allFinite()) return;  // a collapsed prism: its samples can only be drawn as dots
  for (int k = 0; k < 3; ++k) {
    patch.along_u[k] = static_cast<float>(tangents(k, 0));
    patch.along_v[k] = static_cast<float>(tangents(k, 1));
  }
}

Eigen::Vector3f map_normal(const Eigen::Vector3f& r, const Eigen::Vector3f& r_u,
                           const Eigen::Vector3f& r_v, float z, float z_u, float z_v) {
  return (z * r_v + z_v * r).cross(z * r_u + z_u * r).normalized();
}

// One run becomes one chunk: slots filled, bounds, tangents and normal cone measured.
Chunk bind_run(const MapBinder& map, const TexelOrder& order, const TexelRun& run,
               std::size_t first_slot, SampleSet& set) {
  Chunk chunk;
  chunk.count = run.count;
  chunk.patch.face = run.face;
  const ShellMatrix& m = map.rest[run.face];
  const DepthPlane plane = fit_depth(map, order, run);
  const Eigen::Vector3f r0 = map.ray(plane.center.x(), plane.center.y()).cast<float>();
  const Eigen::Vector3f r_u = (map.ray(plane.center.x() + 1, plane.center.y()).cast<float>() - r0);
  const Eigen::Vector3f r_v = (map.ray(plane.center.x(), plane.center.y() + 1).cast<float>() - r0);
  const Eigen::Vector3f mean_normal =
      map_normal(r0, r_u, r_v, static_cast<float>(plane.depth), static_cast<float>(plane.slope.x()),
                 static_cast<float>(plane.slope.y()));
  float smallest_cosine = 1;
  Eigen::Array3f low = Eigen::Array3f::Constant(1e30f), high = -low;
  for (std::uint32_t i = 0; i < run.count; ++i) {
    const std::uint32_t texel = order.texels[run.first + i];
    const float depth = map.maps.depth_mm[texel], h = map.maps.height_mm[texel];
    const Eigen::Vector3d r = map.texel_ray(texel);
    const Eigen::Vector2d b = barycentric_at_height(m, h, depth * r);
    const std::size_t slot = first_slot + i;
    const Eigen::Array3f at(static_cast<float>(b.x()), static_cast<float>(b.y()), h);
    set.b1[slot] = at[0], set.b2[slot] = at[1], set.h[slot] = h;
    low = low.min(at), high = high.max(at);
    const SameSurface same = map.neighbours.same_surface(texel);
    set.detail[slot] = std::bit_cast<PackedDetail>(map.neighbours.detail(texel, same));
    const auto slopes = map.neighbours.depth_slopes(texel, same);
    if (!slopes.has_u || !slopes.has_v) continue;
    const Eigen::Vector3f n = map_normal(r.cast<float>(), r_u, r_v, depth, slopes.u, slopes.v);
    smallest_cosine = std::min(smallest_cosine, n.dot(mean_normal));
  }
  for (int k = 0; k < 3; ++k) {
    chunk.patch.center[k] = 0.5f * (low[k] + high[k]);
    chunk.patch.extent[k] = 0.5f * (high[k] - low[k]);
  }
  chunk.patch.cone_rad = std::acos(std::clamp(smallest_cosine, -1.0f, 1.0f));
  set_tangents(map, plane, chunk.patch);
  return chunk;
}

double mean_texel_mm(const CameraMaps& maps, const TexelOrder& order, double focal_px) {
  double sum = 0;
  for (const std::uint32_t texel : order.texels) sum += maps.depth_mm[texel];
  return order.texels.empty() ? 0 : sum / (focal_px * static_cast<double>(order.texels.size()));
}

}  // namespace

SampleSet build_sample_set(const CameraMaps& maps, const PosedCamera& camera,
                           const std::vector<ShellMatrix>& rest_in_camera) {
  const TexelOrder order = order_texels(maps);
  const double focal = std::sqrt(camera.intrinsics.fx * camera.intrinsics.fy);
  const std::size_t slots = order.runs.size() * kChunk;
  if (slots > kMostSlots) {
    throw BadDataError("camera '" + camera.name +
                       "': its maps hold more samples than can be drawn (" +
                       std::to_string(order.texels.size()) + "); bake it at half the size");
  }
  SampleSet set;
  set.b1.resize(slots), set.b2.resize(slots), set.h.resize(slots);
  set.detail.resize(slots);
  set.chunks.resize(order.runs.size());
  set.sample_count = order.texels.size();
  set.texel_mm = mean_texel_mm(maps, order, focal);
  const MapBinder map{maps, camera, rest_in_camera, MapNeighbours(maps, focal)};
  constexpr std::size_t kGrain = 64;  // chunks a task
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, order.runs.size(), kGrain),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      for (std::size_t c = range.begin(); c < range.end(); ++c) {
                        set.chunks[c] = bind_run(map, order, order.runs[c], c * kChunk, set);
                      }
                    });
  return set;
}

}  // namespace organbake
