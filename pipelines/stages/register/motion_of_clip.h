// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "stages/register/register_clip.h"

namespace organbake {

// Runs the stage `motion` with its defaults on a clip that came without depth, and leaves what it
// makes in `folder`. Returns why the clip tells no motion (the scope stands still, turns or zooms;
// frames that no lens has taken); nothing where it does.
std::string find_motion_of_clip(const ClipToTrack& clip, const std::filesystem::path& folder,
                                const RunContext& context);

}  // namespace organbake
