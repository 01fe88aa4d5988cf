// SPDX-License-Identifier: GPL-3.0-or-later
// Renderings of a surface by ray casting, with derivatives by the pose. Rays go through pixel
// centres and several to a pixel at outlines, so that the picture is a smooth function of the pose;
// the photograph itself is never interpolated, which would smooth its noise and favour some poses.
#include "appearance/prediction.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "cost_functions/cost_functions.h"
#include "organbake/core/parallel.h"
#include "organbake/image/srgb.h"
#include "organbake/raycast/face_queries.h"
#include "organbake/raycast/ray_scene.h"

namespace organbake {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr float kDepthJump = 8;  // depth over width between neighbours: 83° from facing

class Painter {
 public:
  Painter(const RegisteredSurface& surface, const PhotoLevel& level, const ObjectPose& pose,
          double focal_scale, const ShadingBasis& basis)
      : surface_(surface),
        level_(level),
        basis_(basis),
        ray_scale_(1 / focal_scale),
        camera_from_world_(rigid_transform(pose, surface.center())),
        world_from_camera_(camera_from_world_.inverse()),
        pixel_slope_(static_cast<float>(1 / (level.intrinsics.fx * focal_scale))) {}

  void set_window(Prediction& p, int margin) const;
  void trace_centers(Prediction& p, int row) const;
  void slide_centers(Prediction& p, int row) const;
  void paint_row(Prediction& p, int row, bool smooth) const;

 private:
  Vector3d camera_ray(int x, int y) const {
    const Vector3f& ray = level_.rays[level_.index(x, y)];
    return {ray.x() * ray_scale_, ray.y() * ray_scale_, 1};
  }
  Ray world_ray(const Vector3d& direction) const {
    Ray ray;
    ray.origin = world_from_camera_.translation;
    ray.direction = world_from_camera_.rotation * direction;
    return ray;
  }
  bool at_outline(const Prediction& p, int x, int y) const;
  void split_pixel(Prediction& p, int x, int y) const;
  void add(Prediction& p, std::size_t i, const Vector3d& ray, const RayHit& hit, float share) const;
  void finish(Prediction& p, std::size_t i) const;
  float border_px(const RayHit& hit, const Vector3d& x, const Vector3d& normal) const;

  const RegisteredSurface& surface_;
  const PhotoLevel& level_;
  const ShadingBasis& basis_;
  double ray_scale_;
  RigidTransform camera_from_world_, world_from_camera_;
  float pixel_slope_;
};

// The picture of the box round the mesh; all of the level when part of it lies behind the camera.
void Painter::set_window(Prediction& p, int margin) const {
  const Intrinsics& k = level_.intrinsics;
  const Bounds& box = surface_.box();
  double left = 1e9, right = -1e9, top = 1e9, bottom = -1e9;
  int behind = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Vector3d at(corner & 1 ? box.max.x() : box.min.x(),
                      corner & 2 ? box.max.y() : box.min.y(),
                      corner & 4 ? box.max.z() : box.min.z());
    const Vector3d x = camera_from_world_ * at;
    if (!(x.z() > 1e-3 * surface_.radius_mm())) {
      ++behind;
      continue;
    }
    Intrinsics lens = k;
    lens.fx /= ray_scale_;
    lens.fy /= ray_scale_;
    const Eigen::Vector2d pixel = project(lens, x);
    left = std::min(left, pixel.x());
    right = std::max(right, pixel.x());
    top = std::min(top, pixel.y());
    bottom = std::max(bottom, pixel.y());
  }
  if (behind == 8) return;
  if (behind > 0 || k.has_distortion()) {
    left = top = 0;
    right = k.width;
    bottom = k.height;
  }
  const auto clipped = [margin](double value, int size) {
    return static_cast<int>(std::clamp(value + margin, 0.0, static_cast<double>(size)));
  };
  p.left = clipped(left - 2 * margin, k.width);
  p.top = clipped(top - 2 * margin, k.height);
  p.width = clipped(right + 1, k.width) - p.left;
  p.height = clipped(bottom + 1, k.height) - p.top;
}

void Painter::trace_centers(Prediction& p, int row) const {
  std::vector<Ray> rays;
  rays.reserve(p.width);
  for (int x = p.left; x < p.left + p.width; ++x)
    rays.push_back(world_ray(camera_ray(x, p.top + row)));
  surface_.scene().first_hits(rays, {&p.hits[std::size_t(row) * p.width], std::size_t(p.width)});
}

// Where the rays meet the planes of the faces that they met before. What slid off its face by more
// than a little is traced.
void Painter::slide_centers(Prediction& p, int row) const {
  constexpr double kSlack = 0.2;  // corner weight: beyond the face, normals still go on straight
  for (int x = p.left; x < p.left + p.width; ++x) {
    RayHit& hit = p.hits[p.index(x, p.top + row)];
    if (hit.face == kNoHit) continue;
    const Ray ray = world_ray(camera_ray(x, p.top + row));
    const auto& [a, b, c] = surface_.mesh().faces[hit.face];
    const auto& vertices = surface_.mesh().vertices;
    const PlaneCrossing at =
        cross_plane({vertices[a], vertices[b], vertices[c]}, ray.origin, ray.direction);
    if (at.inside_by(-kSlack) && at.t > 0) {
      hit.t = at.t;
      hit.u = static_cast<float>(at.u);
      hit.v = static_cast<float>(at.v);
    } else {
      surface_.scene().first_hits({&ray, 1}, {&hit, 1});
    }
  }
}

bool Painter::at_outline(const Prediction& p, int x, int y) const {
  const RayHit& here = p.hits[p.index(x, y)];
  for (int v = y - 1; v <= y + 1; ++v)
    for (int u = x - 1; u <= x + 1; ++u) {
      if (!p.contains(u, v)) continue;
      const RayHit& there = p.hits[p.index(u, v)];
      if ((here.face == kNoHit) != (there.face == kNoHit)) return true;
      if (here.face == kNoHit) continue;
      const double nearer = std::min(here.t, there.t);
      if (std::abs(here.t - there.t) > kDepthJump * nearer * pixel_slope_) return true;
    }
  return false;
}

// Lengths along the surface show shortened by its slant.
float Painter::border_px(const RayHit& hit, const Vector3d& x, const Vector3d& normal) const {
  constexpr double kLeastSlant = 0.1;
  const double slant = std::abs(normal.dot(x)) / x.norm();
  return static_cast<float>(surface_.border_distance_mm(hit) * std::max(kLeastSlant, slant) /
                            (x.z() * pixel_slope_));
}

void Painter::add(Prediction& p, std::size_t i, const Vector3d& ray, const RayHit& hit,
                  float share) const {
  const Vector3d x = hit.t * ray;
  const auto skin = surface_.skin(hit, world_from_camera_.rotation * ray);
  const Vector3d n = camera_from_world_.rotation * skin.normal;
  double phi[ShadingBasis::kMost];
  basis_.values(x, n, phi);
  for (int j = 0; j + 1 < p.basis; ++j)
    p.phi[i * p.basis + j] += share * skin.albedo * static_cast<float>(phi[j]);
  p.normal[i] += share * n.cast<float>();
  p.albedo[i] += share * skin.albedo;
  p.point[i] += share * x.cast<float>();
  p.coverage[i] += share;
  if (!p.border_px.empty()) p.border_px[i] += share * border_px(hit, x, n);
}

void Painter::finish(Prediction& p, std::size_t i) const {
  p.phi[(i + 1) * p.basis - 1] = 1 - p.coverage[i];
  if (!(p.coverage[i] > 0)) return;
  p.point[i] /= p.coverage[i];
  p.normal[i].normalize();
  if (!p.border_px.empty()) p.border_px[i] /= p.coverage[i];
}

// Rays between pixel centres: the lens is straight over a pixel.
void Painter::split_pixel(Prediction& p, int x, int y) const {
  const Intrinsics& k = level_.intrinsics;
  const int x0 = std::clamp(x, 1, k.width - 2), y0 = std::clamp(y, 1, k.height - 2);
  const Vector3d by_x = (camera_ray(x0 + 1, y) - camera_ray(x0 - 1, y)) / 2;
  const Vector3d by_y = (camera_ray(x, y0 + 1) - camera_ray(x, y0 - 1)) / 2;
  // Eight queens: no two rays share a row, a column or a diagonal; one packet of the ray caster.
  constexpr int kRays = 8;
  constexpr int kRow[kRays] = {3, 6, 2, 7, 1, 4, 0, 5};
  std::array<Vector3d, kRays> directions;
  std::array<Ray, kRays> rays;
  std::array<RayHit, kRays> hits;
  for (int s = 0; s < kRays; ++s) {
    const double u = (s + 0.5) / kRays - 0.5, v = (kRow[s] + 0.5) / kRays - 0.5;
    directions[s] = camera_ray(x, y) + u * by_x + v * by_y;
    rays[s] = world_ray(directions[s]);
  }
  surface_.scene().first_hits(rays, hits);
  for (int s = 0; s < kRays; ++s)
    if (hits[s].face != kNoHit) add(p, p.index(x, y), directions[s], hits[s], 1.0f / kRays);
}

void Painter::paint_row(Prediction& p, int row, bool smooth) const {
  const int y = p.top + row;
  for (int x = p.left; x < p.left + p.width; ++x) {
    const std::size_t i = p.index(x, y);
    if (smooth && at_outline(p, x, y)) {
      split_pixel(p, x, y);
    } else if (p.hits[i].face != kNoHit) {
      add(p, i, camera_ray(x, y), p.hits[i], 1);
    }
    finish(p, i);
  }
}

// Small pictures come in numbers, and the threads are then busy with those.
template <class Row>
void for_rows(const Prediction& p, const Row& row) {
  constexpr int kWorthThreads = 12'000;  // pixels
  if (p.width * p.height > kWorthThreads) {
    parallel_for(0, p.height, row);
  } else {
    for (int y = 0; y < p.height; ++y) row(y);
  }
}

constexpr int kMostSide = 1600;

std::array<std::uint8_t, 3> outline_color(Verdict verdict) {
  if (verdict == Verdict::ok) return {40, 230, 60};
  if (verdict == Verdict::doubtful) return {250, 220, 40};
  return {250, 50, 40};
}

bool on_outline(const Prediction& p, int x, int y) {
  const bool here = p.coverage[p.index(x, y)] >= 0.5f;
  for (const auto& [u, v] : {std::pair(x + 1, y), std::pair(x, y + 1), std::pair(x + 1, y + 1)}) {
    if (p.contains(u, v) && (p.coverage[p.index(u, v)] >= 0.5f) != here) return true;
  }
  return false;
}

// The light that explains the photograph best at the pose, so that both look alike where it fits.
Prediction lit_prediction(const RegisteredSurface& surface, const PhotoLevel& level,
                          const ObjectPose& pose, LightModel light, double& offset) {
  const ShadingBasis basis(light, pose.center_camera_mm.norm());
  Prediction p;
  predict(surface, level, pose, 1, basis, basis.first_weights(), {}, p);
  std::vector<WeightedPixel> pixels = overlap(level, p, 3);
  if (pixels.empty()) return p;
  const Appearance appearance = fit_appearance(level, p, basis, pixels);
  relight(p, appearance.light);
  offset = appearance.offset;
  return p;
}

}  // namespace

void predict(const RegisteredSurface& surface, const PhotoLevel& level, const ObjectPose& pose,
             double focal_scale, const ShadingBasis& basis, const ShadingBasis::Weights& weights,
             const PredictionSettings& settings, Prediction& p) {
  p.basis = basis.size();
  const Painter painter(surface, level, pose, focal_scale, basis);
  if (!settings.keep_faces) {
    p.left = p.top = p.width = p.height = 0;
    painter.set_window(p, settings.margin);
  }
  if (p.empty()) p.width = p.height = 0;
  const std::size_t pixels = std::size_t(p.width) * p.height;
  p.radiance.assign(pixels, 0);
  p.coverage.assign(pixels, 0);
  p.point.assign(pixels, Vector3f::Zero());
  p.normal.assign(pixels, Vector3f::Zero());
  p.albedo.assign(pixels, 0);
  p.phi.assign(pixels * p.basis, 0);
  p.hits.resize(pixels);
  p.border_px.assign(surface.open() ? pixels : 0, 0);
  for_rows(p, [&](int row) {
    if (settings.keep_faces) {
      painter.slide_centers(p, row);
    } else {
      painter.trace_centers(p, row);
    }
  });
  for_rows(p, [&](int row) { painter.paint_row(p, row, settings.smooth_outlines); });
  relight(p, weights);
}

void relight(Prediction& p, const ShadingBasis::Weights& weights) {
  for (std::size_t i = 0; i < p.radiance.size(); ++i) {
    double sum = 0;
    for (int j = 0; j < p.basis; ++j) sum += weights[j] * p.phi_at(i)[j];
    p.radiance[i] = static_cast<float>(sum);
  }
}

Vector3d point_near(const Prediction& p, int x, int y) {
  const std::size_t i = p.index(x, y);
  if (p.coverage[i] > 0) return p.point[i].cast<double>();
  Vector3d sum = Vector3d::Zero();
  int count = 0;
  for (int v = y - 1; v <= y + 1; ++v)
    for (int u = x - 1; u <= x + 1; ++u) {
      if (!p.contains(u, v) || !(p.coverage[p.index(u, v)] > 0)) continue;
      sum += p.point[p.index(u, v)].cast<double>();
      ++count;
    }
  return count > 0 ? Vector3d(sum / count) : sum;
}

PixelDerivative pixel_derivative(const Prediction& p, const Intrinsics& k, const Vector3d& center,
                                 const ShadingBasis& basis, const ShadingBasis::Weights& weights,
                                 int x, int y) {
  PixelDerivative derivative = PixelDerivative::Zero();
  if (!p.contains(x, y)) return derivative;
  const Vector3d point = point_near(p, x, y);
  if (!(point.z() > 0)) return derivative;
  const std::size_t i = p.index(x, y);
  if (p.coverage[i] > 0) {
    const Vector3d normal = p.normal[i].cast<double>();
    const auto g = basis.gradient(point, normal, weights);
    derivative.head<3>() = (point - center).cross(g.by_point) + normal.cross(g.by_normal);
    derivative.segment<3>(3) = g.by_point;
    derivative *= p.albedo[i];
  }
  const auto slope = [&p](int u0, int v0, int u1, int v1) {
    return p.contains(u0, v0) && p.contains(u1, v1)
               ? 0.5 * (p.radiance[p.index(u1, v1)] - p.radiance[p.index(u0, v0)])
               : 0.0;
  };
  const Eigen::RowVector2d gradient(slope(x - 1, y, x + 1, y), slope(x, y - 1, x, y + 1));
  derivative.head<6>() -= (gradient * pixel_motion(k, point, center)).transpose();
  derivative[6] = -gradient.dot(Eigen::Vector2d(x + 0.5 - k.cx, y + 0.5 - k.cy));
  return derivative;
}

Rgb8Image draw_overlay(const RegisteredSurface& surface, const Rgb8Image& photo,
                       const RegisteredPhoto& registered) {
  Rgb8Image image = photo;
  int factor = 1;
  while (std::max(image.width, image.height) > kMostSide) {
    Rgb8Image half(image.width / 2, image.height / 2);
    const cv::Mat whole(image.height, image.width, CV_8UC3, image.pixels.data());
    const cv::Mat even = whole({0, 0, 2 * half.width, 2 * half.height});
    cv::Mat target(half.height, half.width, CV_8UC3, half.pixels.data());
    cv::resize(even, target, target.size(), 0, 0, cv::INTER_AREA);
    image = half;
    factor *= 2;
  }
  const ObjectPose pose = object_pose(registered.camera.camera_from_world, surface.center());
  if (!(pose.center_camera_mm.z() > 0)) return image;
  const std::vector<PhotoLevel> pyramid =
      photo_pyramid(image, {}, reduced(registered.camera.intrinsics, factor), kMostSide, kMostSide);
  if (pyramid.empty()) return image;
  double offset = 0;
  const Prediction p = lit_prediction(surface, pyramid.front(), pose, registered.light, offset);
  const int field = std::max(8, std::max(image.width, image.height) / 12);
  const auto color = outline_color(registered.quality.verdict);
  for (int y = p.top; y < p.top + p.height; ++y)
    for (int x = p.left; x < p.left + p.width; ++x) {
      const std::size_t i = p.index(x, y);
      const bool predicted = p.coverage[i] >= 0.5f && (x / field + y / field) % 2 == 0;
      const std::uint8_t grey = srgb8_from_linear(static_cast<float>(p.radiance[i] + offset));
      const bool edge = on_outline(p, x, y);
      for (int c = 0; c < 3; ++c) {
        if (predicted) image.at(x, y)[c] = grey;
        if (edge) image.at(x, y)[c] = color[c];
      }
    }
  return image;
}

}  // namespace organbake
