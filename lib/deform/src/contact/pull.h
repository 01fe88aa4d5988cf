// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "contact/contact.h"

namespace organbake::deform {

// A step's shape as graspers have pulled it, mm by slot, and how large the largest organ is.
struct PulledShape {
  const PaddedVectors &now, &at_start, &rest;
  double diagonal_mm;
};

bool any_carried(const std::vector<Contact>& contacts);

// Whether tissue would have to follow its graspers beyond any shape, because they are too far away
// or contradict each other.
bool pulled_too_far(const std::vector<Contact>& contacts, const PulledShape& shape);

// The instrument that carries with the largest force; the first one where they are not finite. One
// must carry.
std::uint32_t most_loaded(const std::vector<Contact>& contacts);

}  // namespace organbake::deform
