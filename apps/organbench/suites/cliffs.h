// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "bench.h"

namespace organbake {

// Turns one knob after the other until something breaks, and adds where as points: what is the
// first thing to give way?
void find_cliffs(Bench& bench);

}  // namespace organbake
