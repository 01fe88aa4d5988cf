// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>

#include "organbake/core/random.h"
#include "organbake/phantom/phantom.h"
#include "organbake/registration/object_pose.h"
#include "organbake/registration/register_photo.h"

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

  PhotoToRegister photo(const LampPicture& picture, const Sensor& sensor = {}) const;
};
const LampStudio& lamp_studio();

// A pose off by exactly so much, in directions drawn from the seed.
RigidTransform disturbed(const RegisteredSurface& surface, const RigidTransform& camera_from_world,
                         double shift_mm, double turn_deg, std::uint64_t seed);

}  // namespace organbake
