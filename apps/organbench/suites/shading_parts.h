// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbench/bench.h"

// The shading suite, by what it measures.
namespace organbake {

inline constexpr const char* kRangeError = "relative depth error, mean, one scale fitted";

// The phantom's laparoscopy against its truth, tissues of two albedos, and a real clip's rate.
void promise_clips(Bench& bench);

}  // namespace organbake
