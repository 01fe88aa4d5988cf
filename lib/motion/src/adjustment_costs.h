// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <ceres/ceres.h>
#include <Eigen/Core>

#include "organbake/bundle/breath.h"
#include "organbake/geometry/camera.h"
#include "two_views.h"

namespace organbake {

constexpr int kOfCourse = Breath::kWaves + 1, kOfField = 3 * Breath::kTerms;  // unknowns

constexpr double kNearest = 1e-9;  // before a camera

// The lens with the focal length and k1 of a block.
Intrinsics with_free(Intrinsics lens, const double* free);

// Pixels from a sighting to its landmark's place. Blocks: the pose (angle and axis, then the
// translation), the place, the lens (focal length, k1). `lens` must outlive the cost, as it must
// that of a breath.
class SightingCost : public ceres::SizedCostFunction<2, kOfPose, kOfPlace, kOfLens> {
 public:
  SightingCost(const Eigen::Vector2d& pixel, const Intrinsics& lens,
               const Eigen::Vector3d& pushed = Eigen::Vector3d::Zero())
      : pixel_(pixel), lens_(lens), pushed_(pushed) {}
  bool Evaluate(const double* const* blocks, double* error, double** slopes) const override;

 private:
  Eigen::Vector2d pixel_;
  const Intrinsics& lens_;  // its focal length and k1 aside
  Eigen::Vector3d pushed_;  // what is added to the place
};

// The same where tissue breathes: place + course(time) · field(place). The field's terms are taken
// where the place was. More blocks: the waves of the course with its radians per frame, the field.
ceres::CostFunction* breathing_cost(const Eigen::Vector2d& pixel, const Intrinsics& lens,
                                    double time_frames, const Breath::Terms& terms);

// What all tissue does alike the scope may do as well, and sightings do not tell which. A hand does
// not breathe: of all these ways the scope goes the one that bends the least between what is a
// third of a breath before and after. Pixels, of the scope and of what lies ahead and beside it.
// Blocks: the poses before, now and after; `time` is of the view, 0 before, 1 after; `depth` is how
// far away the tissue is, in the scene's unit.
ceres::CostFunction* even_way_cost(double time, double depth, double weight_px);

}  // namespace organbake
