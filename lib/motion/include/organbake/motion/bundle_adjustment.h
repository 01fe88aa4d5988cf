// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "organbake/motion/sightings.h"

namespace organbake {

// What of the lens is moved with the poses and points. Both focal lengths keep their ratio.
struct FreeLens {
  bool focal = false;
  bool distortion = false;  // k1 alone
  bool center = false;      // of the picture, held where it was by `center_sd_px`
  double center_sd_px = 60;

  bool any() const { return focal || distortion || center; }
};

struct AdjustmentOptions {
  FreeLens lens = {};
  int iterations = 20;      // at most
  double tolerance = 1e-5;  // of the cost's change from one to the next
  double robust_px = 1;     // beyond which an error counts less (Cauchy)
  // Of each view at most about so many sightings are taken, those of the longest tracks first; 0 =
  // all. A few hundred hold a pose as well as thousands, in a fraction of the time.
  std::size_t sightings_per_view = 0;
  // Views that are moved; empty = all. Points that they see are moved with them.
  std::vector<bool> moving = {};
};

struct AdjustmentSummary {
  bool converged = false;
  int iterations = 0;
  std::size_t sightings = 0;
  double rms_px = 0;  // of the robust errors
};

// Moves poses, places and lens together until the sightings that agree lie where the places are
// seen (bundle adjustment, Triggs et al. 2000; Ceres' sparse Schur complement). The first posed
// view of those that move stays where it is, and the scene keeps its size where no lens or pose
// fixes it. Deterministic: one thread, sums in one order.
AdjustmentSummary adjust(const AdjustmentOptions& options, Scene& scene);

// Moves one view alone against places that are known: sightings are of those. Returns how many
// agree to `most_error_px` afterwards.
std::size_t adjust_pose(const Intrinsics& lens, const std::vector<Eigen::Vector3d>& places,
                        const std::vector<Eigen::Vector2d>& pixels, double most_error_px,
                        RigidTransform& camera_from_world);

}  // namespace organbake
