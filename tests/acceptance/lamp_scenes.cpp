// SPDX-License-Identifier: GPL-3.0-or-later
#include "lamp_scenes.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "measuring/known_poses.h"
#include "organbake/core/random.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

OrganPhantomOptions phantom_options(int size, std::uint64_t seed = 1) {
  OrganPhantomOptions options;
  options.seed = seed;
  options.photo_count = 8;
  options.photo_size = size;
  return options;
}

TriangleMesh organ_mesh(const OrganPhantom& phantom) {
  TriangleMesh mesh = phantom.surface(6);
  mesh.colors.clear();
  return mesh;
}

}  // namespace

LampScenes::LampScenes(int photo_size, int cameras, PhotographedSurface photographed)
    : phantom_(phantom_options(photo_size)),
      photographed_(photographed),
      surface_(std::make_unique<RegisteredSurface>(organ_mesh(phantom_))),
      cameras_(phantom_.photo_cameras()) {
  cameras_.resize(std::min(cameras_.size(), static_cast<std::size_t>(cameras)));
}

const RegisteredSurface& LampScenes::other_organ(int seed) const {
  auto& other = others_[seed];
  if (!other) {
    const OrganPhantom phantom(phantom_options(64, static_cast<std::uint64_t>(seed)));
    other = std::make_unique<RegisteredSurface>(organ_mesh(phantom));
  }
  return *other;
}

TriangleMesh LampScenes::mirrored() const {
  TriangleMesh mesh = surface_->mesh();
  const double middle = surface_->center().x();
  for (Vector3d& v : mesh.vertices) v.x() = 2 * middle - v.x();
  for (Face& face : mesh.faces) std::swap(face[1], face[2]);
  return mesh;
}

LampPicture LampScenes::picture(const PosedCamera& camera, const LampScene& scene) const {
  if (photographed_ == PhotographedSurface::mesh)
    return picture_of_mesh_by_lamp(surface_->mesh(), camera);
  return picture_by_lamp(phantom_, surface_->mesh(), camera, scene);
}

PhotoToRegister LampScenes::photo(std::size_t camera, std::uint64_t seed, bool hard) const {
  LampPicture& known = pictures_[{camera, hard}];
  if (known.radiance.empty()) known = picture(cameras_[camera], {hard, hard});
  Sensor sensor;
  sensor.seed = seed;
  if (hard) {
    sensor.gain = 0.9;
    sensor.vignette = 0.4;
  }
  PhotoToRegister photo;
  photo.image = develop(known, sensor);
  photo.intrinsics = cameras_[camera].intrinsics;
  return photo;
}

void LampScenes::put_instrument(Rgb8Image& photo, std::uint64_t seed) const {
  RandomStream random(seed, 78);
  const double angle = random.uniform(0, 2 * std::numbers::pi);
  const double x0 = photo.width / 2.0, y0 = photo.height / 2.0;
  const double half_width = 0.06 * photo.width, tip = -0.25 * photo.width;
  for (int y = 0; y < photo.height; ++y)
    for (int x = 0; x < photo.width; ++x) {
      const double along = (x - x0) * std::cos(angle) + (y - y0) * std::sin(angle);
      const double across = ((y - y0) * std::cos(angle) - (x - x0) * std::sin(angle)) / half_width;
      if (along < tip || std::abs(across) > 1) continue;
      const double round = std::sqrt(1 - across * across) * (0.6 + 0.4 * across);
      std::fill_n(photo.at(x, y), 3, static_cast<std::uint8_t>(40 + 170 * round));
    }
}

RigidTransform LampScenes::start(std::size_t camera, double shift_mm, double turn_deg,
                                 std::uint64_t seed) const {
  RandomStream random(seed, 79);
  const double shift = random.uniform(), turn = random.uniform();
  return start_at_least(camera, shift * shift_mm, turn * turn_deg, seed);
}

RigidTransform LampScenes::start_at_least(std::size_t camera, double shift_mm, double turn_deg,
                                          std::uint64_t seed) const {
  return start_from(*surface_, cameras_[camera].camera_from_world, shift_mm, turn_deg, seed);
}

double LampScenes::mtre_mm(std::size_t camera, const RigidTransform& camera_from_world) const {
  return mean_distance_mm(*surface_, cameras_[camera].camera_from_world, camera_from_world);
}

double LampScenes::reprojection_px(std::size_t camera,
                                   const RigidTransform& camera_from_world) const {
  const PosedCamera& truth = cameras_[camera];
  double sum = 0;
  for (const SurfaceSample& sample : surface_->samples())
    sum += (project(truth.intrinsics, truth.camera_from_world * sample.point) -
            project(truth.intrinsics, camera_from_world * sample.point))
               .norm();
  return sum / static_cast<double>(surface_->samples().size());
}

double LampScenes::floor_mm(std::size_t camera) const {
  if (floors_mm_.contains(camera)) return floors_mm_.at(camera);
  const PosedCamera& truth = cameras_[camera];
  const ObjectPose pose = object_pose(truth.camera_from_world, surface_->center());
  const LampPicture middle = picture(truth, {});
  const auto pixels = static_cast<Eigen::Index>(middle.radiance.size());
  Eigen::MatrixXd j(pixels, 6);
  // About half a pixel each way.
  const double turn = 0.5 * pose.center_camera_mm.z() / truth.intrinsics.fx / surface_->radius_mm();
  const double shift = 0.5 * pose.center_camera_mm.z() / truth.intrinsics.fx;
  for (int k = 0; k < 6; ++k) {
    const double step = k < 3 ? turn : k < 5 ? shift : 4 * shift;
    LampPicture sides[2];
    for (int side = 0; side < 2; ++side) {
      PosedCamera moved_camera = truth;
      const Motion motion = (side == 0 ? step : -step) * Motion::Unit(k);
      moved_camera.camera_from_world = rigid_transform(moved(pose, motion), surface_->center());
      sides[side] = picture(moved_camera, {});
    }
    for (Eigen::Index i = 0; i < pixels; ++i)
      j(i, k) = (sides[0].radiance[i][0] - sides[1].radiance[i][0]) / (2 * step);
  }
  // Gain and offset are nuisances: their columns are projected out.
  Eigen::MatrixXd nuisance(pixels, 2);
  for (Eigen::Index i = 0; i < pixels; ++i) nuisance.row(i) << middle.radiance[i][0], 1;
  const Eigen::Matrix2d normal = nuisance.transpose() * nuisance;
  j -= nuisance * normal.ldlt().solve(nuisance.transpose() * j);
  const Sensor sensor;
  const Eigen::Matrix<double, 6, 6> covariance =
      std::pow(sensor.noise / sensor.gain, 2) *
      (j.transpose() * j).ldlt().solve(Eigen::Matrix<double, 6, 6>::Identity());
  const Eigen::Matrix3d rotation = truth.camera_from_world.rotation;
  double sum = 0;
  for (const SurfaceSample& sample : surface_->samples()) {
    const Vector3d d = rotation * (sample.point - surface_->center());
    Eigen::Matrix<double, 3, 6> motion;
    motion << 0, d.z(), -d.y(), 1, 0, 0, -d.z(), 0, d.x(), 0, 1, 0, d.y(), -d.x(), 0, 0, 0, 1;
    sum += (motion * covariance * motion.transpose()).trace();
  }
  return floors_mm_[camera] = std::sqrt(sum / static_cast<double>(surface_->samples().size()));
}

}  // namespace organbake
