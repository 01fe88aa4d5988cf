// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "organbake/bundle/json_fields.h"
#include "organbake/player/script.h"

namespace organbake {

// A script's "camera": keyframes on an orbit or free ones, with intrinsics of its own, or a
// recorded sequence of cameras.json, one camera a frame. Free keyframes move on a Catmull–Rom curve
// and turn by slerp. `name` is the script's file: a recorded sequence lies relative to it. The
// script's size and frames have been read. Throws BadDataError naming the key.
void read_script_camera(const JsonField& camera, const std::string& name, Script& script);
Json script_camera_json(const Script& script);

}  // namespace organbake
