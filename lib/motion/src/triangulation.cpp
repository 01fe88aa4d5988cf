// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/motion/triangulation.h"

#include <Eigen/Dense>
#include <cmath>

#include "organbake/core/parallel.h"
#include "pixel_slopes.h"

namespace organbake {
namespace {

struct Ray {
  Eigen::Vector3d origin, direction;
};

Ray ray_of(const Scene& scene, const Sighting& sighting) {
  const RigidTransform world_from_camera = scene.camera_from_world[sighting.view]->inverse();
  return {world_from_camera.translation,
          (world_from_camera.rotation * unproject(scene.lens, sighting.pixel)).normalized()};
}

Eigen::Vector3d nearest_to(const Ray& a, const Ray& b) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const Ray& ray : {a, b}) {
    const Eigen::Matrix3d across =
        Eigen::Matrix3d::Identity() - ray.direction * ray.direction.transpose();
    sum += across;
    right += across * ray.origin;
  }
  return sum.ldlt().solve(right);
}

void refine_place(const Scene& scene, Landmark& landmark) {
  constexpr int kSteps = 3;
  for (int step = 0; step < kSteps; ++step) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (const Sighting& sighting : landmark.seen) {
      if (!sighting.agrees || !scene.is_posed(sighting.view)) continue;
      const RigidTransform& pose = *scene.camera_from_world[sighting.view];
      const Eigen::Vector3d point = pose * *landmark.place;
      if (!(point.z() > 0)) return;
      const Eigen::Matrix<double, 2, 3> slopes = pixel_slopes(scene.lens, point) * pose.rotation;
      normal += slopes.transpose() * slopes;
      right += slopes.transpose() * (sighting.pixel - project(scene.lens, point));
    }
    const Eigen::Vector3d move = normal.ldlt().solve(right);
    if (!move.allFinite()) return;
    *landmark.place += move;
  }
}

std::size_t mark_agreeing(const Scene& scene, double most_error_px, Landmark& landmark) {
  std::size_t agreeing = 0;
  for (Sighting& sighting : landmark.seen) {
    if (!scene.is_posed(sighting.view)) continue;
    sighting.agrees = scene.error_px(landmark, sighting) <= most_error_px;
    agreeing += sighting.agrees;
  }
  return agreeing;
}

bool is_sound(const TriangulationOptions& options, const Scene& scene, Landmark& landmark) {
  return landmark.place->allFinite() &&
         mark_agreeing(scene, options.most_error_px, landmark) >= 2 &&
         scene.angle_rad(landmark) >= options.least_angle_rad;
}

void place_landmark(const TriangulationOptions& options, const Scene& scene, Landmark& landmark) {
  std::vector<Ray> rays;
  for (const Sighting& sighting : landmark.seen)
    if (scene.is_posed(sighting.view)) rays.push_back(ray_of(scene, sighting));
  double widest = std::cos(options.least_angle_rad);
  const Ray *a = nullptr, *b = nullptr;
  for (std::size_t i = 0; i < rays.size(); ++i)
    for (std::size_t j = i + 1; j < rays.size(); ++j)
      if (const double cosine = rays[i].direction.dot(rays[j].direction); cosine < widest) {
        widest = cosine;
        a = &rays[i];
        b = &rays[j];
      }
  if (!a) return;
  landmark.place = nearest_to(*a, *b);
  if (mark_agreeing(scene, 2 * options.most_error_px, landmark) >= 2) refine_place(scene, landmark);
  if (!is_sound(options, scene, landmark)) landmark.place.reset();
}

}  // namespace

void triangulate(const TriangulationOptions& options, Scene& scene,
                 std::optional<std::size_t> view) {
  parallel_pieces(std::size_t{0}, scene.landmarks.size(), std::size_t{256},
                  [&](std::size_t first, std::size_t last) {
                    for (std::size_t i = first; i < last; ++i) {
                      Landmark& landmark = scene.landmarks[i];
                      if (!landmark.place && (!view || sighting_in(landmark, *view)))
                        place_landmark(options, scene, landmark);
                    }
                  });
}

std::size_t drop_outliers(const TriangulationOptions& options, Scene& scene) {
  std::size_t agreeing = 0;
  for (Landmark& landmark : scene.landmarks) {
    if (!landmark.place) continue;
    if (!is_sound(options, scene, landmark)) {
      landmark.place.reset();
      continue;
    }
    for (const Sighting& sighting : landmark.seen)
      agreeing += sighting.agrees && scene.is_posed(sighting.view);
  }
  return agreeing;
}

}  // namespace organbake
