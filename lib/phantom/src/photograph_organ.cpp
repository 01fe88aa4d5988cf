// SPDX-License-Identifier: GPL-3.0-or-later
#include "photograph_organ.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "organbake/core/parallel.h"
#include "organbake/image/srgb.h"
#include "organbake/phantom/phantom.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr int kTile = 8;  // pixels a side: rays near each other run through the scene together
constexpr int kRaysPerSide = 2, kRays = kRaysPerSide * kRaysPerSide;

class Film {
 public:
  Film(const Organ& organ, const RayScene& near_surface, const PosedCamera& camera)
      : organ_(organ),
        near_surface_(near_surface),
        lens_(camera.intrinsics),
        eye_(camera.center_world_mm()),
        world_from_camera_(camera.camera_from_world.rotation.transpose()) {}

  void expose(int left, int top, Rgb8Image& image) const {
    const int right = std::min(left + kTile, image.width);
    const int bottom = std::min(top + kTile, image.height);
    std::vector<Ray> rays;
    for (int y = top; y <= bottom; ++y)
      for (int x = left; x <= right; ++x) rays.push_back(ray_through(x, y));
    const std::vector<RayHit> corners = trace(rays);
    const int stride = right - left + 1;
    for (int y = top; y < bottom; ++y)
      for (int x = left; x < right; ++x) {
        const RayHit* corner = &corners[(y - top) * stride + x - left];
        const Vector3d color =
            pixel_color(x, y, {corner[0].t, corner[1].t, corner[stride].t, corner[stride + 1].t});
        for (int c = 0; c < 3; ++c)
          image.at(x, y)[c] = srgb8_from_linear(static_cast<float>(color[c]));
      }
  }

 private:
  std::vector<RayHit> trace(const std::vector<Ray>& rays) const {
    std::vector<RayHit> hits(rays.size());
    near_surface_.first_hits(rays, hits);
    return hits;
  }

  // Inside the outline, texture and shading change little over a pixel: its centre stands for all
  // of it. Where the depths at its corners are steep, or some miss, the rays are averaged.
  Vector3d pixel_color(int x, int y, const Eigen::Array4d& corner_depths) const {
    constexpr double kSteep = 3;  // depth over width: 72° from facing
    const double nearest = corner_depths.minCoeff(), farthest = corner_depths.maxCoeff();
    if (std::isinf(nearest)) return Vector3d::Zero();
    if (farthest - nearest < kSteep * nearest / lens_.fx)
      return radiance(ray_through(x + 0.5, y + 0.5), corner_depths.mean());
    std::vector<Ray> rays;
    for (int sub = 0; sub < kRays; ++sub)
      rays.push_back(ray_through(x + (sub % kRaysPerSide + 0.5) / kRaysPerSide,
                                 y + (sub / kRaysPerSide + 0.5) / kRaysPerSide));
    const std::vector<RayHit> hits = trace(rays);
    Vector3d sum = Vector3d::Zero();
    for (int sub = 0; sub < kRays; ++sub)
      if (hits[sub].face != kNoHit) sum += radiance(rays[sub], hits[sub].t);
    return sum / kRays;
  }

  Ray ray_through(double x_px, double y_px) const {
    Ray ray;
    ray.origin = eye_;
    ray.direction = (world_from_camera_ * unproject(lens_, {x_px, y_px})).normalized();
    return ray;
  }

  // The mesh's chord misses the formula's surface by some hundredths of a millimetre; two Newton
  // steps along the ray mend that. At a silhouette, where they could leap away, they are short.
  Vector3d radiance(const Ray& ray, double t) const {
    constexpr double kLongestStepMm = 0.3;
    constexpr double kLeastSlope = 0.02;
    const Vector3d direction = ray.direction;
    Vector3d normal = -direction;
    for (int step = 0; step < 2; ++step) {
      const OrganShape::Sample at = organ_.shape.sample(eye_ + t * direction);
      const double slope = at.gradient.dot(direction);
      if (std::abs(slope) > kLeastSlope)
        t -= std::clamp(at.value / slope, -kLongestStepMm, kLongestStepMm);
      normal = -at.gradient.normalized();
    }
    const Vector3d point = eye_ + t * direction;
    const Vector3d color =
        organ_.diffuse(point, normal) + studio_lighting().glossy(normal, -direction);
    return color.cwiseMin(1.0);  // the sensor clips before the pixel averages
  }

  const Organ& organ_;
  const RayScene& near_surface_;
  Intrinsics lens_;
  Vector3d eye_;
  Eigen::Matrix3d world_from_camera_;
};

}  // namespace

Rgb8Image photograph_organ(const Organ& organ, const RayScene& near_surface,
                           const PosedCamera& camera, const RunContext& context) {
  camera.intrinsics.check();
  Rgb8Image image(camera.intrinsics.width, camera.intrinsics.height);
  const Film film(organ, near_surface, camera);
  const int tile_rows = (image.height + kTile - 1) / kTile;
  parallel_for(0, tile_rows, [&](int row) {
    context.throw_if_cancelled();
    for (int left = 0; left < image.width; left += kTile) film.expose(left, row * kTile, image);
  });
  return image;
}

const Lighting& studio_lighting() {
  using Eigen::Vector3d;
  static const Lighting lighting = {
      .ambient_above = {0.50, 0.51, 0.53},
      .ambient_below = {0.32, 0.30, 0.28},
      .up = Vector3d::UnitZ(),
      .lamps = {{Vector3d(-0.45, -0.75, 0.48).normalized(), {1.55, 1.49, 1.40}},
                {Vector3d(0.62, 0.58, 0.10).normalized(), {0.60, 0.66, 0.75}}},
      .gloss = {{0.045, 25}, {0.32, 180}},
      .scope = {},
      .finish = {}};
  return lighting;
}

}  // namespace organbake
