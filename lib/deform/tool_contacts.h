// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "deform/deformer.h"

namespace organbake::deform {

// Tools are hard: tips that would lie in each other are moved apart, each by half, until they
// touch. Inactive tips stay out of it. Many tools pressed together may keep a little overlap.
std::vector<InstrumentTip> held_apart(std::vector<InstrumentTip> tips);

// The parameters (0…1) of the nearest points of two segments, each from its `at` along its `way`,
// which may be zero.
struct NearestOnSegments {
  double first = 0, second = 0;
};
NearestOnSegments nearest_on_segments(const Eigen::Vector3d& first_at,
                                      const Eigen::Vector3d& first_way,
                                      const Eigen::Vector3d& second_at,
                                      const Eigen::Vector3d& second_way);

}  // namespace organbake::deform
