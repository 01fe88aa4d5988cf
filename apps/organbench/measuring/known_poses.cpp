// SPDX-License-Identifier: GPL-3.0-or-later
#include "measuring/known_poses.h"

#include <numbers>

#include "organbake/registration/object_pose.h"

namespace organbake {

using Eigen::Vector3d;

Vector3d random_direction(RandomStream& random) {
  return Vector3d(random.normal(), random.normal(), random.normal()).normalized();
}

RigidTransform start_from(const RegisteredSurface& surface, const RigidTransform& truth,
                          double shift_mm, double turn_deg, std::uint64_t seed) {
  RandomStream random(seed, 77);
  Motion motion;
  motion << turn_deg * std::numbers::pi / 180 * random_direction(random),
      shift_mm * random_direction(random);
  return rigid_transform(moved(object_pose(truth, surface.center()), motion), surface.center());
}

double mean_distance_mm(const RegisteredSurface& surface, const RigidTransform& a,
                        const RigidTransform& b) {
  double sum = 0;
  for (const SurfaceSample& sample : surface.samples())
    sum += (a * sample.point - b * sample.point).norm();
  return sum / static_cast<double>(surface.samples().size());
}

}  // namespace organbake
