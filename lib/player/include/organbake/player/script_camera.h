// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "organbake/bundle/cameras_json.h"
#include "organbake/player/script.h"
#include "organbake/warp/view.h"

namespace organbake {

// Plays the script from these cameras instead of its own. Throws UsageError naming `name` for
// distortion, several sizes or fewer cameras than frames. A script without a size takes theirs.
void take_recorded(const CameraSet& cameras, const std::string& name, Script& script);

// Who looks at a frame, in a picture of width × height pixels: intrinsics that were given for
// another size are scaled. Throws UsageError as orbit_view() does.
View view_at(const Script& script, int frame, const CameraSet& cameras, int width, int height);
// A camera's view in another size.
View view_of(const PosedCamera& camera, int width, int height);

}  // namespace organbake
