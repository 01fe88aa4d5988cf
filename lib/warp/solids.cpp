// SPDX-License-Identifier: Apache-2.0
#include "warp/solids.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <optional>

#include "image/srgb.h"
#include "warp/pixel_box.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

struct Hit {
  double along = std::numeric_limits<double>::infinity();  // × ray; the ray has z = 1: depth
  Vector3d normal = Vector3d::Zero();
};

// First hit of the ray t·d (from the eye) with a sphere.
void hit_sphere(const Vector3d& d, const Vector3d& center, double radius, double near, Hit& hit) {
  const double a = d.squaredNorm(), b = d.dot(center), c = center.squaredNorm() - radius * radius;
  const double discriminant = b * b - a * c;
  if (discriminant < 0) return;
  const double t = (b - std::sqrt(discriminant)) / a;
  if (t > near && t < hit.along) hit = {t, (t * d - center) / radius};
}

// The same with the side of a cylinder between two points.
void hit_side(const Vector3d& d, const Vector3d& from, const Vector3d& to, double radius,
              double near, Hit& hit) {
  const double length = (to - from).norm();
  if (!(length > 0)) return;
  const Vector3d axis = (to - from) / length;
  const Vector3d across = d - axis * axis.dot(d), origin = -from + axis * axis.dot(from);
  const double a = across.squaredNorm(), b = across.dot(origin),
               c = origin.squaredNorm() - radius * radius;
  const double discriminant = b * b - a * c;
  if (!(a > 0) || discriminant < 0) return;
  const double t = (-b - std::sqrt(discriminant)) / a;
  const double height = axis.dot(t * d - from);
  if (t > near && t < hit.along && height >= 0 && height <= length) {
    hit = {t, (t * d - from - axis * height) / radius};
  }
}

struct PlacedSolid {
  Vector3d from, to;
  double radius;
  Eigen::Vector3f color;
};

// Brushed metal under a lamp at the eye: diffuse, a highlight, a darker rim.
Eigen::Vector3f shade(const PlacedSolid& solid, const Hit& hit, const Vector3d& d) {
  const float facing = static_cast<float>(std::max(0.0, -hit.normal.dot(d.normalized())));
  const float lamp = 0.12f + 0.88f * facing;
  const float highlight = 0.5f * std::pow(facing, 40.0f);
  return (solid.color * lamp + Eigen::Vector3f::Constant(highlight)).cwiseMin(1.0f);
}

// Pixels around a sphere in camera space, also beside the picture; the whole picture when it
// reaches the near plane.
PixelBox sphere_box(const Vector3d& center, double radius, const View& view) {
  const Intrinsics& k = view.camera.intrinsics;
  const double z = center.z() - radius;
  if (z <= view.near_mm) return {0, 0, k.width, k.height};
  const auto low = [](double c, double r, double z0, double z1) {
    return (c - r) / (c - r < 0 ? z0 : z1);
  };
  const double far = center.z() + radius;
  const double x0 = k.fx * low(center.x(), radius, z, far) + k.cx;
  const double x1 = -k.fx * low(-center.x(), radius, z, far) + k.cx;
  const double y0 = k.fy * low(center.y(), radius, z, far) + k.cy;
  const double y1 = -k.fy * low(-center.y(), radius, z, far) + k.cy;
  static constexpr double kFar = 1e6;  // pixels: keeps what becomes an int in range
  const auto whole = [](double v) { return static_cast<int>(std::clamp(v, -kFar, kFar)); };
  return {whole(x0 - 1), whole(y0 - 1), whole(x1 + 2), whole(y1 + 2)};
}

struct PixelHit {
  Eigen::Vector3f color = Eigen::Vector3f::Zero();  // summed over the rays that hit
  int rays = 0;
  double depth = std::numeric_limits<double>::infinity();
};

constexpr int kSide = 2;

PixelHit trace_pixel(const std::vector<PlacedSolid>& solids, const View& view, int x, int y,
                     double tissue_depth) {
  const Intrinsics& k = view.camera.intrinsics;
  PixelHit pixel;
  for (int ray = 0; ray < kSide * kSide; ++ray) {
    const double px = x + (ray % kSide + 0.5) / kSide, py = y + (ray / kSide + 0.5) / kSide;
    const Vector3d d((px - k.cx) / k.fx, (py - k.cy) / k.fy, 1);
    Hit nearest;
    const PlacedSolid* shown = nullptr;
    for (const PlacedSolid& solid : solids) {
      const double before = nearest.along;
      hit_sphere(d, solid.from, solid.radius, view.near_mm, nearest);
      hit_sphere(d, solid.to, solid.radius, view.near_mm, nearest);
      hit_side(d, solid.from, solid.to, solid.radius, view.near_mm, nearest);
      if (nearest.along < before) shown = &solid;
    }
    if (!shown || !(nearest.along < tissue_depth)) continue;
    pixel.color += shade(*shown, nearest, d);
    pixel.depth = std::min(pixel.depth, nearest.along);
    ++pixel.rays;
  }
  return pixel;
}

std::vector<PlacedSolid> placed_in(const View& view, const std::vector<Solid>& solids) {
  const RigidTransform& pose = view.camera.camera_from_world;
  std::vector<PlacedSolid> placed;
  for (const Solid& solid : solids) {
    placed.push_back({pose * solid.from, pose * solid.to, solid.radius_mm, solid.color});
  }
  return placed;
}

}  // namespace

PixelBox solids_box(const std::vector<Solid>& solids, const View& view) {
  PixelBox box;
  for (const PlacedSolid& p : placed_in(view, solids)) {
    box = united(box, united(sphere_box(p.from, p.radius, view), sphere_box(p.to, p.radius, view)));
  }
  // Cut only now: a shaft that leads out of the picture ends beside it.
  return intersected(box, {0, 0, view.camera.intrinsics.width, view.camera.intrinsics.height});
}

std::size_t draw_solids(const std::vector<Solid>& solids, const View& view, Frame& frame) {
  const std::vector<PlacedSolid> placed = placed_in(view, solids);
  const PixelBox box = solids_box(solids, view);
  if (box.empty()) return 0;
  std::atomic<std::size_t> touched = 0;
  tbb::parallel_for(box.y0, box.y1, [&](int y) {
    std::size_t in_row = 0;
    for (int x = box.x0; x < box.x1; ++x) {
      const std::size_t at = std::size_t(y) * frame.color.width + x;
      const PixelHit hit = trace_pixel(placed, view, x, y, frame.depth_mm[at]);
      if (hit.rays == 0) continue;
      const float share = 1.0f / (kSide * kSide);
      std::uint8_t* rgb = frame.color.at(x, y);
      for (int k = 0; k < 3; ++k) {
        const float below = linear_from_srgb8()[rgb[k]];
        const float rest = 1 - share * static_cast<float>(hit.rays);
        rgb[k] = srgb8_from_linear(share * hit.color[k] + rest * below);
      }
      frame.cover[at] = Cover::solid;
      frame.depth_mm[at] = static_cast<float>(hit.depth);
      ++in_row;
    }
    touched += in_row;
  });
  return touched;
}

}  // namespace organbake
