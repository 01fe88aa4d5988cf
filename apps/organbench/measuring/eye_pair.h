// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

#include "organbake/phantom/laparoscopy.h"
#include "organbake/stereo/stereo_depth.h"

namespace organbake {

// What both eyes of an endoscope see of the phantom's laparoscopy at 40…100 mm.
struct EyePair {
  EyePair(int width, int height, std::uint64_t seed);

  LaparoscopyFrame left, right;
  Rectifier rectifier;

  // The depth of the left eye; where it shows tissue, when that is asked for.
  StereoDepth matched(Mask* tissue = nullptr) const;

 private:
  explicit EyePair(const LaparoscopyPhantom& phantom);
};

}  // namespace organbake
