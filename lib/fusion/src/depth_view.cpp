// SPDX-License-Identifier: GPL-3.0-or-later
// A depth map with its pose, smoothed as far as its noise asks for, with normals and weights.
#include "organbake/fusion/fuse_views.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "organbake/core/error.h"
#include "organbake/core/quantile.h"
#include "organbake/core/text.h"
#include "organbake/shading/depth_maps.h"
#include "organbake/shading/grid_filters.h"

namespace organbake {
namespace {

void check(const DepthView& view, const std::vector<float>& depths) {
  const Intrinsics& k = view.camera.intrinsics;
  const auto size = [](int width, int height) {
    return std::to_string(width) + "x" + std::to_string(height);
  };
  if (view.depth_mm.width != k.width || view.depth_mm.height != k.height)
    throw BadDataError(view.name, "is " + size(view.depth_mm.width, view.depth_mm.height) +
                                      ", its camera " + size(k.width, k.height) +
                                      "; they must be of one size");
  if (view.confidence.size() > 0 && (view.confidence.width != view.depth_mm.width ||
                                     view.confidence.height != view.depth_mm.height))
    throw BadDataError(view.name, "has a confidence map of another size");
  k.check();
  if (depths.empty()) throw BadDataError(view.name, "holds no depth: no pixel is finite");
  const double usual = median(depths);
  if (!(usual >= kNearestDepth_mm && usual <= kFarthestDepth_mm))
    throw BadDataError(view.name,
                       "has depths of about " + to_text(usual) + " mm; that must be in " +
                           to_text(kNearestDepth_mm) + "…" + to_text(kFarthestDepth_mm) +
                           ": are they in another unit (--unit), or relative (--scale one)?");
}

// Standard deviation of a pixel about the plane of its neighbours, by the median.
double noise_of(const Plane& depth, const Plane& known) {
  constexpr int kNear_px = 2, kEvery = 3;
  const LocalPlanes planes(depth, known, kNear_px);
  std::vector<float> off;
  for (int y = 0; y < depth.height; y += kEvery)
    for (int x = 0; x < depth.width; x += kEvery)
      if (known.at(x, y) > 0 && planes.weight(x, y) > 0.9F)
        off.push_back(std::abs(planes.at(x, y).value - depth.at(x, y)));
  return off.empty() ? 0 : kSigmaOfMedianDeviation * median(std::move(off));
}

// So many that their mean is as good as the geometry is told; never wider than detail is.
int radius_for(double noise_mm, double depth_mm) {
  constexpr double kGoodShare = 4e-4;  // of the depth
  constexpr double kWidest_px = 6;
  const double pixels_across = noise_mm / (kGoodShare * depth_mm);
  return static_cast<int>(std::lround(std::clamp((pixels_across / 1.5 - 1) / 2, 1.0, kWidest_px)));
}

Plane smoothed(const Plane& depth, const Plane& known, double noise_mm, int radius) {
  Plane smooth = depth;
  const LocalPlanes planes(depth, known, radius);
  // Where the surface leaves its plane by more than noise does, an edge is near: it stays.
  const double usual = std::max(noise_mm * noise_mm, 1e-6);
  for (int y = 0; y < depth.height; ++y)
    for (int x = 0; x < depth.width; ++x) {
      if (known.at(x, y) <= 0) continue;
      const LocalPlanes::Fit fit = planes.at(x, y);
      constexpr double kBeyond = 3;
      const double beyond = std::max(0.0, fit.variance / usual - kBeyond);
      const auto keep = static_cast<float>(beyond / (1 + beyond));
      smooth.at(x, y) = fit.value + keep * (depth.at(x, y) - fit.value);
    }
  return smooth;
}

}  // namespace

Eigen::Vector3d SmoothView::point_world_mm(int x, int y) const {
  const Eigen::Vector3d ray = unproject(camera.intrinsics, {x + 0.5, y + 0.5});
  return camera.camera_from_world.inverse() * Eigen::Vector3d(double(depth_mm.at(x, y)) * ray);
}

Eigen::Vector3d SmoothView::normal_world(int x, int y) const {
  return camera.camera_from_world.rotation.transpose() *
         normals[depth_mm.index(x, y)].cast<double>();
}

bool is_same_side(const SmoothView& view, const SeenSurface& seen,
                  const Eigen::Vector3d& normal_world) {
  constexpr double kAlike = 0.7;  // cosine
  return (view.camera.camera_from_world.rotation * normal_world).dot(seen.normal_camera) > kAlike;
}

void scale_depth(double factor, SmoothView& view) {
  for (float& z : view.depth_mm.values) z *= static_cast<float>(factor);
  view.noise_mm *= factor;
}

void scale_place(double factor, SmoothView& view) {
  view.camera.camera_from_world.translation *= factor;
}

SmoothView smooth_view(const DepthView& view) {
  const int width = view.depth_mm.width, height = view.depth_mm.height;
  Plane known(width, height), depth(width, height);
  std::vector<float> depths;
  for (std::size_t k = 0; k < known.size(); ++k) {
    const float z = view.depth_mm.values[k];
    if (!std::isfinite(z) || z <= 0) continue;
    known.values[k] = 1;
    depth.values[k] = z;
    depths.push_back(z);
  }
  check(view, depths);
  SmoothView smooth;
  smooth.camera = view.camera;
  const Intrinsics lens = smooth.camera.intrinsics = pinhole_of(view.camera.intrinsics);
  const double usual_mm = median(std::move(depths));
  smooth.noise_mm = noise_of(depth, known);
  const int radius = radius_for(smooth.noise_mm, usual_mm);
  // A quarter of the window: detail that it leaves takes a few voxels.
  constexpr double kOfWindow = 0.25;
  smooth.resolution_px = std::max(1.0, kOfWindow * (2 * radius + 1));
  smooth.depth_mm = smoothed(depth, known, smooth.noise_mm, radius);
  const RayGrid rays = ray_grid(lens);
  Plane log_range(width, height);
  smooth.weight = Plane(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      float& z = smooth.depth_mm.at(x, y);
      const bool is_known = known.at(x, y) > 0 && z > 0;
      const double along = std::hypot(1.0, rays.x(x), rays.y(y));
      log_range.at(x, y) = static_cast<float>(std::log(along * (is_known ? z : usual_mm)));
      if (!is_known) z = std::numeric_limits<float>::infinity();
    }
  smooth.normals = normals_from_log_range(log_range, rays);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      if (!std::isfinite(smooth.depth_mm.at(x, y))) continue;
      const Eigen::Vector3d ray = Eigen::Vector3d(rays.x(x), rays.y(y), 1).normalized();
      const std::size_t k = known.index(x, y);
      const double cosine = std::max(0.0, -smooth.normals[k].cast<double>().dot(ray));
      const float trust = view.confidence.size() > 0 ? view.confidence.values[k] : 1;
      smooth.weight.values[k] = static_cast<float>(trust * cosine * cosine);
    }
  return smooth;
}

double usual_depth_mm(std::span<const SmoothView> views) {
  constexpr std::size_t kEvery = 97;  // a prime: usual widths are sampled at different columns
  std::vector<float> depths;
  for (const SmoothView& view : views)
    for (std::size_t k = 0; k < view.depth_mm.size(); k += kEvery)
      if (view.weight.values[k] > 0) depths.push_back(view.depth_mm.values[k]);
  return median(std::move(depths));
}

SeenSurface seen_at(const SmoothView& view, const Eigen::Vector3d& point_world_mm) {
  SeenSurface seen;
  const Eigen::Vector3d point = view.camera.camera_from_world * point_world_mm;
  seen.point_z_mm = point.z();
  if (!(point.z() > 0)) return seen;
  const Intrinsics& k = view.camera.intrinsics;
  const double u = k.fx * point.x() / point.z() + k.cx - 0.5;
  const double v = k.fy * point.y() / point.z() + k.cy - 0.5;
  if (!(u >= 0 && v >= 0 && u < k.width - 1 && v < k.height - 1)) return seen;
  const int x = static_cast<int>(u), y = static_cast<int>(v);
  const double a = u - x, b = v - y;
  const double shares[4] = {(1 - a) * (1 - b), a * (1 - b), (1 - a) * b, a * b};
  double nearest = std::numeric_limits<double>::infinity(), farthest = 0;
  for (int i = 0; i < 4; ++i) {
    const std::size_t at = view.depth_mm.index(x + i % 2, y + i / 2);
    const double z = view.depth_mm.values[at];
    if (!std::isfinite(z)) return seen;
    nearest = std::min(nearest, z);
    farthest = std::max(farthest, z);
    seen.depth_mm += shares[i] * z;
    seen.normal_camera += shares[i] * view.normals[at].cast<double>();
    seen.weight += shares[i] * view.weight.values[at];
  }
  // Between a front and what lies behind it there is no surface.
  constexpr double kJump = 0.03;
  if (farthest - nearest > kJump * nearest + 4 * view.noise_mm) seen.weight = 0;
  seen.normal_camera.normalize();
  return seen;
}

}  // namespace organbake
