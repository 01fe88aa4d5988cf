// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "organbake/player/orbit.h"

namespace organbake {

struct PictureSize {
  int width = 1280, height = 720;  // pixels
};

// The values of options that are more than a number or a name. Each throws a UsageError that names
// the option and what was written.
PictureSize size_from(const std::string& text);            // --size, WIDTHxHEIGHT
OrbitPose pose_from(const std::string& text);              // --view, AZIMUTH,ELEVATION[,DISTANCE]
std::vector<double> angles_from(const std::string& text);  // --angles, A,B,C

}  // namespace organbake
