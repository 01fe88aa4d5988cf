// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/core/random.h"
#include "organbake/phantom/phantom.h"
#include "organbake/registration/register_photo.h"
#include "organbake/registration/registered_surface.h"
#include "support/testing.h"

namespace organbake {

// The phantom, photographed small enough for a test: made once a program, since its formula is
// slow.
struct LampStudio {
  OrganPhantom phantom;
  // Without the phantom's colours: for most tests, as each search draws all faces many times; and
  // as it is photographed, for those that ask for hundredths of a millimetre.
  RegisteredSurface surface, fine;
  std::vector<PosedCamera> cameras;
  LampPicture plain;     // of camera 0: shading alone
  LampPicture textured;  // with albedo and highlights

  PhotoToRegister photo(const LampPicture& picture, const Sensor& sensor = {}) const {
    PhotoToRegister photo;
    photo.image = develop(picture, sensor);
    photo.intrinsics = cameras[0].intrinsics;
    return photo;
  }
};

inline const LampStudio& lamp_studio() {
  static const std::unique_ptr<const LampStudio> studio = [] {
    OrganPhantomOptions options;
    options.photo_count = 8;
    options.photo_size = 256;
    const OrganPhantom phantom(options);
    TriangleMesh coarse = phantom.surface(5), mesh = phantom.surface(6);
    coarse.colors.clear(), mesh.colors.clear();
    const auto cameras = phantom.photo_cameras();
    return std::make_unique<const LampStudio>(
        LampStudio{phantom, RegisteredSurface(coarse), RegisteredSurface(mesh), cameras,
                   picture_by_lamp(phantom, mesh, cameras[0], {}),
                   picture_by_lamp(phantom, mesh, cameras[0], {true, true})});
  }();
  return *studio;
}

// A pose off by exactly so much, in directions drawn from the seed.
inline RigidTransform disturbed(const RegisteredSurface& surface,
                                const RigidTransform& camera_from_world, double shift_mm,
                                double turn_deg, std::uint64_t seed) {
  RandomStream random(seed);
  const auto direction = [&] {
    return Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
  };
  Motion motion;
  motion << turn_deg * std::numbers::pi / 180 * direction(), shift_mm * direction();
  return rigid_transform(moved(object_pose(camera_from_world, surface.center()), motion),
                         surface.center());
}

}  // namespace organbake
