// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

#include "organbake/core/random.h"
#include "organbake/geometry/rigid_transform.h"
#include "organbake/registration/registered_surface.h"

namespace organbake {

Eigen::Vector3d random_direction(RandomStream& random);  // unit

// A pose that is off by exactly so much.
RigidTransform start_from(const RegisteredSurface& surface, const RigidTransform& truth,
                          double shift_mm, double turn_deg, std::uint64_t seed);
double mean_distance_mm(const RegisteredSurface& surface, const RigidTransform& a,
                        const RigidTransform& b);

}  // namespace organbake
