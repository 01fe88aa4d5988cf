// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "measuring/measurement.h"
#include "organbake/bundle/bundle.h"
#include "organbake/warp/view.h"

// How the player's frames are timed.
namespace organbake {

inline constexpr int kFrames = 10;  // of one timing: an orbit, so that no frame is the last one

struct FrameSize {
  int width, height;
  double target_ms = 0;  // one thread, gradient-corrected, fill included
  std::string name() const { return std::to_string(width) + "×" + std::to_string(height); }
};

// Of the orbit: as near as a surgeon looks, the organ fills about 45 % of a wide picture.
View view_at(const Bundle& bundle, const FrameSize& size, int frame);

// From the middle between three cameras, all of which are drawn, hardly moving.
View view_between_three(const Bundle& bundle, const FrameSize& size, int frame);

// Of one of `count`, and of kFrames.
Timing of_one(Timing timing, std::size_t count);
double ms_of(const Timing& timing);

}  // namespace organbake
