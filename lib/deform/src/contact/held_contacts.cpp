// SPDX-License-Identifier: Apache-2.0
// Blades make another skin, and the old contacts' faces are none of it. What lasts is found again
// by its place at rest, which a cut does not change.
#include "contact/held_contacts.h"

#include "contact/grasp.h"

namespace organbake::deform {
namespace {

// The skin that is nearest to where the tip held it, at rest.
bool find_anew(const PaddedVector& at_rest, const ContactSearch& search, const PosedSkin& posed,
               Contact& contact) {
  Skin& skin = posed.skin;
  skin.pose(search.tissue().rest());
  contact.at = skin.nearest(at_rest).at;
  skin.pose(posed.x);
  return search.response_of(contact.at).free_share > 0;
}

}  // namespace

std::vector<HeldContact> held_contacts(const std::vector<Contact>& contacts, Skin& skin,
                                       const PaddedVectors& rest, const PaddedVectors& x) {
  std::vector<HeldContact> held;
  skin.pose(rest);
  for (const Contact& c : contacts)
    if (c.lasts()) held.push_back({c, skin.hit(c.at, PaddedVector::Zero()).point});
  skin.pose(x);
  return held;
}

void hold_anew(const std::vector<HeldContact>& held, const std::vector<Instrument>& instruments,
               const ContactSearch& search, const PosedSkin& posed,
               std::vector<Contact>& contacts) {
  const auto center_of = [&](const Contact& c) {
    return padded(instruments[c.instrument].position_mm);
  };
  std::size_t first = contacts.size();  // of those of one grasper: they stand together
  const auto tie_anew = [&] {
    if (first == contacts.size()) return;
    tie_to_grasper(center_of(contacts[first]), search, posed.skin, contacts, first);
    first = contacts.size();
  };
  for (auto [contact, at_rest] : held) {
    if (contact.instrument >= instruments.size()) continue;
    if (first < contacts.size() && contacts[first].instrument != contact.instrument) tie_anew();
    if (!find_anew(at_rest, search, posed, contact)) continue;
    const bool on_needle = contact.as<OnNeedle>() != nullptr;
    if (on_needle) search.place(contact, center_of(contact));
    contacts.push_back(contact);
    if (on_needle) first = contacts.size();
  }
  tie_anew();
}

}  // namespace organbake::deform
