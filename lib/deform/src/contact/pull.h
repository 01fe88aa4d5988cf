// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "body/tissue.h"
#include "contact/contact.h"

namespace organbake::deform {

// A step's shape as graspers have pulled it, mm by slot, and how large the largest organ is.
struct PulledShape {
  const PaddedVectors &now, &at_start, &rest;
  double diagonal_mm;
};

// What grasps of each organ hold, N; 0: any.
using GraspStrengths = std::vector<double>;

bool any_carried(const std::vector<Contact>& contacts);

// Whether tissue would have to follow its graspers beyond any shape, because they are too far away
// or contradict each other.
bool pulled_too_far(const std::vector<Contact>& contacts, const PulledShape& shape);

// The instrument that carries with the largest force; the first one where they are not finite. One
// must carry.
std::uint32_t most_loaded(const std::vector<Contact>& contacts);

// The instrument that carries with a larger force than its grasp of the tissue holds, if any; of
// several the one beyond its strength by most.
std::optional<std::uint32_t> overloaded(const std::vector<Contact>& contacts, const Tissue& tissue,
                                        const GraspStrengths& strength_n);

}  // namespace organbake::deform
