// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "body/skin.h"
#include "contact/contact.h"
#include "contact/contact_search.h"

namespace organbake::deform {

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

}  // namespace organbake::deform
