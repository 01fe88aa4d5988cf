// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "bench.h"
#include "organbake/phantom/shading_surfaces.h"

// The shading suite, by what it measures.
namespace organbake {

inline constexpr const char* kRangeError = "relative depth error, mean, one scale fitted";

// The phantom's laparoscopy against its truth, tissues of two albedos, and a real clip's rate.
void promise_clips(Bench& bench);

// The phantom's laparoscopy with its light divided out, lit anew from views aside.
void promise_relit(Bench& bench);

// How little harmless changes of a picture change its depth.
void promise_stability(Bench& bench);

// A stereo endoscope's depth against the phantom's, and its rate.
void promise_stereo(Bench& bench);

// Noisy depth maps of the phantom organ, fused, against its surface and colours.
void promise_fusion(Bench& bench);

// What ours makes of the scene on which it was most wrong.
struct WorstScene {
  double error = -1;
  std::string task;
  NearScene scene;
  Plane log_range;
};
void show_worst_scene(Bench& bench, const WorstScene& worst);

}  // namespace organbake
