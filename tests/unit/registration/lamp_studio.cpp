// SPDX-License-Identifier: GPL-3.0-or-later
#include "lamp_studio.h"

#include <numbers>

namespace organbake {
namespace {

OrganPhantomOptions options() {
  OrganPhantomOptions options;
  options.photo_count = 8;
  options.photo_size = 256;
  return options;
}

TriangleMesh colorless(TriangleMesh mesh) {
  mesh.colors.clear();
  return mesh;
}

Eigen::Vector3d random_direction(RandomStream& random) {
  const Eigen::Vector3d v(random.normal(), random.normal(), random.normal());
  return v.normalized();
}

}  // namespace

PhotoToRegister LampStudio::photo(const LampPicture& picture, const Sensor& sensor) const {
  PhotoToRegister photo;
  photo.image = develop(picture, sensor);
  photo.intrinsics = cameras[0].intrinsics;
  return photo;
}

const LampStudio& lamp_studio() {
  static const std::unique_ptr<const LampStudio> studio = [] {
    const OrganPhantom phantom(options());
    const TriangleMesh mesh = colorless(phantom.surface(6));
    const auto cameras = phantom.photo_cameras();
    return std::make_unique<const LampStudio>(
        LampStudio{phantom, RegisteredSurface(colorless(phantom.surface(5))),
                   RegisteredSurface(mesh), cameras, picture_by_lamp(phantom, mesh, cameras[0], {}),
                   picture_by_lamp(phantom, mesh, cameras[0], {true, true})});
  }();
  return *studio;
}

RigidTransform disturbed(const RegisteredSurface& surface, const RigidTransform& camera_from_world,
                         double shift_mm, double turn_deg, std::uint64_t seed) {
  RandomStream random(seed);
  Motion motion;
  motion << turn_deg * std::numbers::pi / 180 * random_direction(random),
      shift_mm * random_direction(random);
  return rigid_transform(moved(object_pose(camera_from_world, surface.center()), motion),
                         surface.center());
}

}  // namespace organbake
