// SPDX-License-Identifier: Apache-2.0
// Makes samples of one camera's maps. In: the maps and the shell at rest. Out: chunks of up to 64
// texels that lie on one face, each bound to it, with its bounds, the change of place by texel
// (from a plane fitted to the depth) and the cone of its normals.
#include "samples/samples.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "organbake/core/error.h"
#include "picture/spans.h"

namespace organbake {
namespace {

// Everything that the pieces of one map share while it is bound.
struct MapBinder {
  const CameraMaps& maps;
  const PosedCamera& camera;
  const std::vector<ShellMatrix>& rest;
  const TexelOrder& order;
  const MapDetail& detail;

  Eigen::Vector3d ray(double u, double v) const {
    const Intrinsics& k = camera.intrinsics;
    if (k.has_distortion()) return unproject(k, {u, v});
    return {(u - k.cx) / k.fx, (v - k.cy) / k.fy, 1.0};
  }
};

// The texels of one run: centres, depths, heights, and rays of planar depth 1.
struct RunTexels {
  std::uint32_t count;
  std::array<double, kChunk> u, v, depth, height, ray_x, ray_y;

  RunTexels(const MapBinder& map, const TexelRun& run) : count(run.count) {
    const std::uint32_t* const texels = &map.order.texels[run.first];
    for (std::uint32_t i = 0; i < count; ++i) {
      depth[i] = map.maps.depth_mm[texels[i]];
      height[i] = map.maps.height_mm[texels[i]];
    }
    const double width = map.maps.width, rows_a_texel = 1 / width;
    for (std::uint32_t i = 0; i < count; ++i) {
      const double texel = static_cast<std::int32_t>(texels[i]);
      const double row = std::floor((texel + 0.5) * rows_a_texel);
      u[i] = texel - row * width + 0.5;
      v[i] = row + 0.5;
    }
    const Intrinsics& k = map.camera.intrinsics;
    for (std::uint32_t i = 0; i < count; ++i)
      ray_x[i] = (u[i] - k.cx) / k.fx, ray_y[i] = (v[i] - k.cy) / k.fy;
    for (std::uint32_t i = 0; k.has_distortion() && i < count; ++i) {
      const Eigen::Vector3d ray = map.ray(u[i], v[i]);
      ray_x[i] = ray.x(), ray_y[i] = ray.y();
    }
  }
};

// barycentric_at_height() of a run's texels, several at once.
struct RunPlaces {
  std::array<double, kChunk> b1, b2;

  RunPlaces(const ShellMatrix& m, const RunTexels& at) {
    for (std::uint32_t i = 0; i < at.count; ++i) {
      const double h = at.height[i], z = at.depth[i];
      const std::array<double, 3> point = {z * at.ray_x[i], z * at.ray_y[i], z};
      double a = 0, b = 0, c = 0, r1 = 0, r2 = 0;
      for (int k = 0; k < 3; ++k) {
        const double e1 = m(k, 1) + h * m(k, 4), e2 = m(k, 2) + h * m(k, 5);
        const double d = point[k] - m(k, 0) - h * m(k, 3);
        a += e1 * e1, b += e1 * e2, c += e2 * e2, r1 += e1 * d, r2 += e2 * d;
      }
      const double determinant = a * c - b * b;
      const bool collapsed = !(std::abs(determinant) > 0);
      const double at1 = (c * r1 - b * r2) / determinant, at2 = (a * r2 - b * r1) / determinant;
      b1[i] = collapsed ? 1.0 / 3 : at1;
      b2[i] = collapsed ? 1.0 / 3 : at2;
    }
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

// Skin that the camera sees at more than 72° gets a plane less steep than it is: a sample stands
// for a piece of the plane, and longer ones leave the curved skin and stick out of a view's
// outline, by pixels.
Eigen::Vector2d at_most_steep(const Eigen::Vector2d& slope, double texel_mm) {
  constexpr double kSteepest = 3;  // texels of depth to one across
  const double steepest = kSteepest * texel_mm, steepness = slope.norm();
  return steepness > steepest ? steepest / steepness * slope : slope;
}

DepthPlane fit_depth(const MapBinder& map, const RunTexels& run, const ShellMatrix& face) {
  DepthPlane plane{.center = Eigen::Vector2d::Zero()};
  for (std::uint32_t i = 0; i < run.count; ++i) {
    plane.center += Eigen::Vector2d(run.u[i], run.v[i]);
    plane.depth += run.depth[i];
  }
  plane.center /= run.count;
  plane.depth /= run.count;
  constexpr double kPriorWeight = 0.5;  // texels²: as much as one neighbour pair says
  double uu = kPriorWeight, uv = 0, vv = kPriorWeight;
  Eigen::Vector2d right = kPriorWeight * face_slope(map, face, plane.center, plane.depth);
  for (std::uint32_t i = 0; i < run.count; ++i) {
    const Eigen::Vector2d d = Eigen::Vector2d(run.u[i], run.v[i]) - plane.center;
    uu += d.x() * d.x(), uv += d.x() * d.y(), vv += d.y() * d.y();
    right += d * (run.depth[i] - plane.depth);
  }
  Eigen::Matrix2d normal;
  normal << uu, uv, uv, vv;
  plane.slope = at_most_steep(normal.inverse() * right, plane.depth / map.camera.intrinsics.fx);
  return plane;
}

// How the surface moves per texel in shell coordinates: the camera's ray derivative along the
// fitted plane, through the inverse of the shell map's Jacobian.
void set_tangents(const MapBinder& map, const ShellMatrix& m, const DepthPlane& plane,
                  Patch& patch) {
  const Eigen::Matrix3d shell =
      shell_jacobian(m, patch.center[0], patch.center[1], patch.center[2]);
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

// The surface's normals over a map piece, whose rays change by r_u and r_v per texel: with z(u, v)
// along r(u, v), n ∝ z (r_v × r_u) + z_u (r_v × r) + z_v (r × r_u).
struct MapNormals {
  Eigen::Vector3f r_u, r_v, both = r_v.cross(r_u);

  Eigen::Vector3f at(const Eigen::Vector3f& r, float z, float z_u, float z_v) const {
    return z * both + z_u * r_v.cross(r) + z_v * r.cross(r_u);
  }
};

// Cosine of the widest angle between the run's normals and `middle`. A texel without slopes has no
// normal; its NaN never is the smallest.
float least_cosine(const MapDetail& detail, std::size_t first_slot, const RunTexels& run,
                   const MapNormals& normals, const Eigen::Vector3f& middle) {
  std::array<float, kChunk> cosine;
  for (std::uint32_t i = 0; i < run.count; ++i) {
    const Eigen::Vector3f r(static_cast<float>(run.ray_x[i]), static_cast<float>(run.ray_y[i]), 1);
    const Eigen::Vector3f n =
        normals.at(r, static_cast<float>(run.depth[i]), detail.slope_u[first_slot + i],
                   detail.slope_v[first_slot + i]);
    cosine[i] = n.dot(middle) / std::sqrt(n.squaredNorm());
  }
  float least = 1;
  for (std::uint32_t i = 0; i < run.count; ++i) least = cosine[i] < least ? cosine[i] : least;
  return least;
}

// One run becomes one chunk: slots filled, bounds, tangents and normal cone measured. Tells its
// mean depth.
double bind_run(const MapBinder& map, std::size_t number, SampleSet& set) {
  const TexelRun& run = map.order.runs[number];
  const std::size_t first_slot = number * kChunk;
  const RunTexels at(map, run);
  const ShellMatrix m = in_frame(map.rest[run.face], map.camera.camera_from_world);
  const RunPlaces places(m, at);
  Chunk& chunk = set.chunks[number];
  chunk.count = run.count;
  chunk.patch.face = run.face;
  SampleSet::Bound bound;
  for (std::uint32_t i = 0; i < run.count; ++i) {
    bound[0][i] = static_cast<float>(places.b1[i]);
    bound[1][i] = static_cast<float>(places.b2[i]);
    bound[2][i] = static_cast<float>(at.height[i]);
  }
  set.put(bound, run.count, first_slot, chunk.patch);
  const DepthPlane plane = fit_depth(map, at, m);
  const double u = plane.center.x(), v = plane.center.y();
  const Eigen::Vector3f r0 = map.ray(u, v).cast<float>();
  const MapNormals normals{map.ray(u + 1, v).cast<float>() - r0,
                           map.ray(u, v + 1).cast<float>() - r0};
  const Eigen::Vector3f middle =
      normals
          .at(r0, static_cast<float>(plane.depth), static_cast<float>(plane.slope.x()),
              static_cast<float>(plane.slope.y()))
          .normalized();
  chunk.patch.cone = NormalCone(std::acos(
      std::clamp(least_cosine(map.detail, first_slot, at, normals, middle), -1.0f, 1.0f)));
  set_tangents(map, m, plane, chunk.patch);
  return plane.depth;
}

}  // namespace

void SampleSet::put(const Bound& bound, std::uint32_t count, std::size_t first_slot, Patch& patch) {
  const std::array kept = {&b1, &b2, &h};
  for (int k = 0; k < 3; ++k) {
    const float* const at = bound[k].data();
    const Eigen::Map<const Eigen::ArrayXf> all(at, count);
    const float low = all.minCoeff(), high = all.maxCoeff();
    const float center = 0.5f * (low + high), extent = 0.5f * (high - low);
    const float scale = extent > 0 ? kFullCoordinate / extent : 0;
    PatchCoordinate* const out = kept[k]->data() + first_slot;
    for (std::uint32_t i = 0; i < count; ++i) {
      const float place = std::round((at[i] - center) * scale);
      const float limited = place < kFullCoordinate ? place : kFullCoordinate;
      out[i] = static_cast<PatchCoordinate>(
          static_cast<std::int32_t>(limited > -kFullCoordinate ? limited : -kFullCoordinate));
    }
    patch.center[k] = center, patch.extent[k] = extent;
  }
}

void SampleSet::copy_patches() {
  std::vector<Patch> copied;
  copied.reserve(chunks.size());
  for (const Chunk& chunk : chunks) copied.push_back(chunk.patch);
  patches = PatchTable(copied);
}

SampleSet build_sample_set(CameraMaps maps, const PosedCamera& camera,
                           const std::vector<ShellMatrix>& rest) {
  const TexelOrder order = order_texels(maps);
  const double focal = std::sqrt(camera.intrinsics.fx * camera.intrinsics.fy);
  const std::size_t slots = order.runs.size() * kChunk;
  if (slots > kMostSlots) {
    throw BadDataError("camera '" + camera.name +
                       "': its maps hold more samples than can be drawn (" +
                       std::to_string(order.texels.size()) + "); bake it at half the size");
  }
  // The order knows the faces: their place is their slots' now.
  std::fill(maps.face.begin(), maps.face.end(), kNoFace);
  for (std::size_t r = 0; r < order.runs.size(); ++r)
    for (std::uint32_t i = 0; i < order.runs[r].count; ++i)
      maps.face[order.texels[order.runs[r].first + i]] = static_cast<std::uint32_t>(r * kChunk + i);
  MapDetail detail(maps, focal, slots);
  maps.face = decltype(maps.face)();  // makes room for the samples
  SampleSet set;
  set.b1.resize(slots), set.b2.resize(slots), set.h.resize(slots);
  set.colors = std::move(detail.colors);
  set.chunks.resize(order.runs.size());
  set.sample_count = order.texels.size();
  const MapBinder map{maps, camera, rest, order, detail};
  std::vector<double> depth_mm(order.runs.size());
  constexpr std::size_t kGrain = 64;  // chunks a task
  parallel_each(std::size_t{0}, order.runs.size(), kGrain,
                [&](std::size_t c) { depth_mm[c] = bind_run(map, c, set); });
  for (std::size_t c = 0; c < depth_mm.size(); ++c)
    set.texel_mm += depth_mm[c] * order.runs[c].count;
  set.texel_mm /= focal * std::max(1.0, static_cast<double>(set.sample_count));
  set.copy_patches();
  return set;
}

}  // namespace organbake
