// SPDX-License-Identifier: Apache-2.0
#include "contact/needles.h"

namespace organbake::deform {
namespace {

// Skin gives way to a needle that has pushed it in so far, and not beside its point.
constexpr double kPierced_mm = 4;
constexpr double kAtPoint = 0.1;  // of the needle's length

// The contact at a needle's point that has gone in farthest; none if not far enough.
const Contact* pierced(const InstrumentSweep& sweep, const std::vector<Contact>& contacts) {
  const Contact* deepest = nullptr;
  double depth_mm = kPierced_mm;
  for (const Contact& c : contacts) {
    const Pressed* pressed = c.as<Pressed>();
    if (c.instrument != sweep.instrument || !pressed || !pressed->from_front || c.force.isZero(0))
      continue;
    const double in_mm = (c.point - c.anchored_at).dot(c.normal);
    if (in_mm < depth_mm || tip_at(sweep, 1).along(c.point) > kAtPoint) continue;
    depth_mm = in_mm, deepest = &c;
  }
  return deepest;
}

}  // namespace

std::vector<Contact> let_needles_through(const std::vector<InstrumentSweep>& sweeps,
                                         std::vector<Contact>& contacts) {
  std::erase_if(contacts,
                [](const Contact& c) { return c.as<OnNeedle>() && up_needle(c, c.point) < 0; });
  std::vector<Contact> punctures;
  for (const InstrumentSweep& sweep : sweeps) {
    const Contact* pushed = sweep.to.is<Needle>() ? pierced(sweep, contacts) : nullptr;
    if (!pushed) continue;
    punctures.push_back(*pushed);
    Contact through = *pushed;
    through.kind = OnNeedle{};
    through.force.setZero();
    std::erase_if(contacts, [&](const Contact& c) { return c.instrument == sweep.instrument; });
    contacts.push_back(through);
  }
  return punctures;
}

}  // namespace organbake::deform
