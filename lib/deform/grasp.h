// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "deform/contact.h"
#include "deform/contact_search.h"

namespace organbake::deform {

// The skin points that a closing grasper carries: the nearest one when it lies within two radii,
// and lattice nodes within the radius, spread out. Each keeps its place relative to the tip.
void close_grasper(const TipSweep& sweep, const std::vector<std::uint32_t>& faces,
                   const ContactSearch& search, Skin& skin, std::vector<Contact>& contacts);

}  // namespace organbake::deform
