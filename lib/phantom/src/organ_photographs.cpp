// SPDX-License-Identifier: GPL-3.0-or-later
// Photographs of the phantom organ: rays meet a mesh near the surface first and are brought onto
// the formula's surface then. Under the studio's lights for colours, by one lamp for what is
// learned from shading.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "formulas.h"
#include "organbake/core/parallel.h"
#include "organbake/core/random.h"
#include "organbake/image/srgb.h"
#include "organbake/phantom/phantom.h"
#include "organbake/raycast/ray_scene.h"

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

namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr int kInside = 2, kOutline = 5;  // rays per pixel side
constexpr double kGlint = 0.9, kGlintExponent = 180;

// What a ray meets.
struct Skin {
  Vector3d point, normal;
  Vector3d albedo = Vector3d::Ones();
};
using SkinAt = std::function<Skin(const Ray&, const RayHit&)>;

// The mesh brings the ray near, one short Newton step puts it on the formula's surface.
Skin skin_of_formula(const OrganPhantom& phantom, bool textured, const Ray& ray,
                     const RayHit& hit) {
  constexpr double kLongestStepMm = 0.3, kLeastSlope = 0.05;
  Skin skin{ray.origin + hit.t * ray.direction, {}};
  skin.normal = phantom.normal(skin.point);
  const double slope = -skin.normal.dot(ray.direction);
  if (slope > kLeastSlope) {
    const double step = phantom.inside(skin.point) / slope;
    skin.point -= std::clamp(step, -kLongestStepMm, kLongestStepMm) * ray.direction;
    skin.normal = phantom.normal(skin.point);
  }
  if (textured) skin.albedo = phantom.albedo(skin.point).cast<double>();
  return skin;
}

Skin skin_of_mesh(const TriangleMesh& mesh, const std::vector<Vector3d>& normals,
                  const AlbedoAt& albedo, const Ray& ray, const RayHit& hit) {
  const auto& [a, b, c] = mesh.faces[hit.face];
  const Vector3d normal =
      (1 - hit.u - hit.v) * normals[a] + hit.u * normals[b] + hit.v * normals[c];
  Skin skin{ray.origin + hit.t * ray.direction, normal.normalized()};
  if (albedo) skin.albedo = albedo(skin.point);
  return skin;
}

// Light that arrives along a direction.
struct Arriving {
  Vector3d toward;  // unit, surface → light
  double strength, ambient;
};

// At a point in camera axes; strength 1 at the reference distance on the optical axis.
Arriving arriving(const PhotoLight& light, double reference_mm, const Vector3d& x) {
  if (light.toward) return {light.toward->normalized(), 1 - light.ambient, light.ambient};
  const Vector3d way = light.lamp_camera_mm - x;
  const double r = way.norm();
  const double beam = std::pow(std::max(0.0, -way.z() / r), light.beam_exponent);
  return {way / r, beam * std::pow(reference_mm / r, light.falloff), 0};
}

class Lamp {
 public:
  Lamp(SkinAt skin_at, const RayScene& near_surface, const PosedCamera& camera,
       const LampScene& scene, double reference_mm)
      : skin_at_(std::move(skin_at)),
        near_surface_(near_surface),
        lens_(camera.intrinsics),
        eye_(camera.center_world_mm()),
        world_from_camera_(camera.camera_from_world.rotation.transpose()),
        scene_(scene),
        reference_mm_(reference_mm) {}

  void expose_row(int y, LampPicture& picture) const {
    for (int x = 0; x < picture.width; ++x) {
      int missed = 0;
      Vector3d sum = rays(x, y, kInside, missed);
      // The organ's outline crosses the pixel, or may just touch it.
      if (missed > 0 && (missed < kInside * kInside || near_outline(x, y)))
        sum = rays(x, y, kOutline, missed);
      picture.radiance[std::size_t(y) * picture.width + x] = sum.cast<float>();
    }
  }

 private:
  Vector3d rays(int x, int y, int side, int& missed) const {
    std::array<Ray, kOutline * kOutline> rays;
    std::array<RayHit, kOutline * kOutline> hits;
    const std::size_t count = static_cast<std::size_t>(side) * side;
    for (std::size_t s = 0; s < count; ++s)
      rays[s] = ray(x + (s % side + 0.5) / side, y + (s / side + 0.5) / side);
    near_surface_.first_hits({rays.data(), count}, {hits.data(), count});
    missed = 0;
    Vector3d sum = Vector3d::Zero();
    for (std::size_t s = 0; s < count; ++s) {
      missed += hits[s].face == kNoHit;
      if (hits[s].face != kNoHit) sum += radiance(rays[s], hits[s]);
    }
    return sum / static_cast<double>(count);
  }
  bool near_outline(int x, int y) const {
    std::array<Ray, 4> rays = {ray(x - 0.2, y - 0.2), ray(x + 1.2, y - 0.2), ray(x - 0.2, y + 1.2),
                               ray(x + 1.2, y + 1.2)};
    std::array<std::uint8_t, 4> hit{};
    near_surface_.occluded(rays, hit);
    return std::any_of(hit.begin(), hit.end(), [](std::uint8_t h) { return h != 0; });
  }
  Ray ray(double x_px, double y_px) const {
    Ray ray;
    ray.origin = eye_;
    ray.direction = (world_from_camera_ * unproject(lens_, {x_px, y_px})).normalized();
    return ray;
  }
  Vector3d radiance(const Ray& ray, const RayHit& hit) const {
    const Skin skin = skin_at_(ray, hit);
    const Eigen::Matrix3d camera_from_world = world_from_camera_.transpose();
    const Vector3d normal = camera_from_world * skin.normal;
    const Vector3d view = -(camera_from_world * ray.direction);
    const Arriving light =
        arriving(scene_.light, reference_mm_, camera_from_world * (skin.point - eye_));
    const double cosine = std::max(0.0, normal.dot(light.toward));
    Vector3d color = (light.ambient + light.strength * cosine) * skin.albedo;
    if (scene_.highlights && cosine > 0) {
      const double half = std::max(0.0, normal.dot((view + light.toward).normalized()));
      color.array() += kGlint * light.strength * std::pow(half, kGlintExponent);
    }
    return color;
  }

  SkinAt skin_at_;
  const RayScene& near_surface_;
  Intrinsics lens_;
  Vector3d eye_;
  Eigen::Matrix3d world_from_camera_;
  LampScene scene_;
  double reference_mm_;
};

LampPicture expose(const Lamp& lamp, const Intrinsics& lens, const RunContext& context) {
  LampPicture picture{lens.width, lens.height, {}};
  picture.radiance.assign(std::size_t(picture.width) * picture.height, Vector3f::Zero());
  parallel_for(0, picture.height, [&](int y) {
    context.throw_if_cancelled();
    lamp.expose_row(y, picture);
  });
  return picture;
}

double distance_mm(const PosedCamera& camera, const TriangleMesh& mesh) {
  return (camera.center_world_mm() - bounds(mesh).center()).norm();
}

}  // namespace

LampPicture picture_by_lamp(const OrganPhantom& phantom, const TriangleMesh& near_surface,
                            const PosedCamera& camera, const LampScene& scene,
                            const RunContext& context) {
  camera.intrinsics.check();
  const RayScene rays(near_surface);
  const auto skin = [&](const Ray& ray, const RayHit& hit) {
    return skin_of_formula(phantom, scene.textured, ray, hit);
  };
  return expose(Lamp(skin, rays, camera, scene, distance_mm(camera, near_surface)),
                camera.intrinsics, context);
}

LampPicture picture_of_mesh_by_lamp(const TriangleMesh& mesh, const PosedCamera& camera,
                                    const LampScene& scene, const AlbedoAt& albedo,
                                    const RunContext& context) {
  camera.intrinsics.check();
  const RayScene rays(mesh);
  const std::vector<Vector3d> normals = vertex_normals(mesh);
  const auto skin = [&](const Ray& ray, const RayHit& hit) {
    return skin_of_mesh(mesh, normals, scene.textured ? albedo : AlbedoAt{}, ray, hit);
  };
  return expose(Lamp(skin, rays, camera, scene, distance_mm(camera, mesh)), camera.intrinsics,
                context);
}

Rgb8Image develop(const LampPicture& picture, const Sensor& sensor) {
  Rgb8Image photo(picture.width, picture.height);
  const double half2 = (std::pow(picture.width, 2) + std::pow(picture.height, 2)) / 4;
  parallel_for(0, picture.height, [&](int y) {
    RandomStream random(sensor.seed, static_cast<std::uint64_t>(y));
    for (int x = 0; x < picture.width; ++x) {
      const double r2 =
          std::pow(x + 0.5 - picture.width / 2.0, 2) + std::pow(y + 0.5 - picture.height / 2.0, 2);
      const double gain = sensor.gain * (1 - sensor.vignette * r2 / half2);
      const double rest = sensor.offset + sensor.noise * random.normal();
      const Vector3f& radiance = picture.radiance[std::size_t(y) * picture.width + x];
      for (int c = 0; c < 3; ++c)
        photo.at(x, y)[c] = srgb8_from_linear(static_cast<float>(gain * radiance[c] + rest));
    }
  });
  return photo;
}

}  // namespace organbake
