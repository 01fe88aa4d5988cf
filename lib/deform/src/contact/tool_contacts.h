// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "organbake/instruments/instrument.h"

namespace organbake::deform {

// Tools are hard: tips that would lie in each other are moved apart, each by half, until they
// touch. Inactive tips stay out of it. Many tools pressed together may keep a little overlap.
std::vector<Instrument> held_apart(std::vector<Instrument> tips);

// The same on the way from where tips were held to where they are asked for, piece by piece, so
// that neither a fast tool passes through another nor one that keeps being pushed. A tip that was
// not there before starts where it is asked for; one that meets none ends there.
std::vector<Instrument> moved_apart(const std::vector<Instrument>& held,
                                    const std::vector<Instrument>& asked);

// Pairs of tips that touch.
std::size_t count_touching(const std::vector<Instrument>& tips);

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
