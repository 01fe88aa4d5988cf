// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "contact/contact.h"
#include "contact/contact_search.h"

namespace organbake::deform {

// The skin points that a closing grasper carries: the nearest one when it lies within two radii,
// and lattice nodes within the radius, spread out. Each keeps its place relative to the tip.
void close_grasper(const InstrumentSweep& sweep, const std::vector<std::uint32_t>& faces,
                   const ContactSearch& search, Skin& skin, std::vector<Contact>& contacts);

// Ties the points from `first` on to the tip that carries them, as the skin lies, and to each other
// (CarrierResponse). Drops those that cannot give way.
void tie_to_grasper(const PaddedVector& center, const ContactSearch& search, const Skin& skin,
                    std::vector<Contact>& contacts, std::size_t first);

}  // namespace organbake::deform
