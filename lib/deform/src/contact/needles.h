// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "contact/contact.h"

namespace organbake::deform {

// At the end of a step: what a needle has pushed in far enough it goes through there, and holds the
// skin from then on by that one contact; what its point was drawn out of it leaves. Returns the
// contacts by which needles pushed what they went through.
std::vector<Contact> let_needles_through(const std::vector<InstrumentSweep>& sweeps,
                                         std::vector<Contact>& contacts);

}  // namespace organbake::deform
