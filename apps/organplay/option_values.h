// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "organbake/player/orbit.h"

namespace organbake {

struct PictureSize {
  int width = 1280, height = 720;  // pixels
};

// An option whose angles are written in degrees, or, under the name it had once, in radians.
struct AngleOption {
  std::string flag;
  bool in_degrees = true;
};

// The values of options that are more than a number or a name. Each throws a UsageError that names
// the option and what was written.
PictureSize size_from(const std::string& text);  // --size, WIDTHxHEIGHT
// AZIMUTH,ELEVATION[,DISTANCE] and A,B,C
OrbitPose pose_from(const AngleOption& option, const std::string& text);
std::vector<double> angles_from(const AngleOption& option, const std::string& text);

}  // namespace organbake
