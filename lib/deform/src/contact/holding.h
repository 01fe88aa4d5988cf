// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "body/skin.h"
#include "body/tissue.h"
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

// What an instrument carries or has gone through, and where that point of the skin lies at rest.
struct HeldContact {
  Contact contact;
  PaddedVector at_rest;
};

// Those of the contacts that last. The skin is left as it lies in the shape x.
std::vector<HeldContact> held_contacts(const std::vector<Contact>& contacts, Skin& skin,
                                       const PaddedVectors& rest, const PaddedVectors& x);

// A skin in the shape x, where it is left.
struct PosedSkin {
  Skin& skin;
  const PaddedVectors& x;
};

// Has the instruments hold another skin of the same organs, as blades have cut it, by its points
// that lie nearest at rest. What cannot give way there is let go.
void hold_anew(const std::vector<HeldContact>& held, const std::vector<Instrument>& instruments,
               const ContactSearch& search, const PosedSkin& posed, std::vector<Contact>& contacts);

// At the end of a step: what a needle has pushed in far enough it goes through there, and holds the
// skin from then on by that one contact; what its point was drawn out of it leaves. Returns the
// contacts by which needles pushed what they went through.
std::vector<Contact> let_needles_through(const std::vector<InstrumentSweep>& sweeps,
                                         std::vector<Contact>& contacts);

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
