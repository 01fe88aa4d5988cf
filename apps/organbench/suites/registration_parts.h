// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace organbake {

class Bench;

// Whole organs under four kinds of light with exact and wrong lenses, and open pieces of organs.
void promise_what_people_have(Bench& bench);
// A clip that is tracked from frame to frame.
void promise_tracking(Bench& bench);

}  // namespace organbake
