// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "organbake/player/play.h"
#include "organbake/player/player.h"

namespace organbake {

// One line of JSON, with its newline, of what lies behind a frame: its number, its time, the camera
// (px, mm; of the picture that was written), each instrument (mm, N, whether it is there), the
// points of its skin that they touch (mm, unit normals, N), how many contacts there were, and where
// the vertices of each organ's proxy lie (world mm).
std::string scene_line(int frame, const PosedCamera& camera, const PlayedScene& scene,
                       const Player& player, const std::vector<std::string>& instrument_names);

}  // namespace organbake
