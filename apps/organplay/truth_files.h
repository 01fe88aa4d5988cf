// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "command.h"
#include "organbake/core/run_context.h"
#include "organbake/player/player.h"
#include "organbake/player/script.h"
#include "organbake/truth/truth_recorder.h"
#include "organbake/warp/view.h"

namespace organbake {

// From --layers and --stereo, checked.
TruthOptions truth_options(const Command& command, const Script& script, const Player& player,
                           std::shared_ptr<const LensPicture> lens);

// Of --lens, for pictures of that size; nothing without one.
std::shared_ptr<const LensPicture> lens_picture(const Command& command, int width, int height);

// --cameras; their distortion is left out where --lens stands in its place.
CameraSet recorded_cameras(const Command& command);

// The first camera of --cameras, in --size or its own.
View first_recorded_view(const Command& command);

// The layers, the right eye and cameras.json of one view, beside its picture: for picture.png
// picture_depth.exr, picture_right.png, picture_right_depth.exr, picture_cameras.json and so on.
// frame: the view, drawn with its bound pixels kept. lens: may be empty.
void write_truth_of_view(const Command& command, Player& player, const View& view,
                         const LensPicture* lens, const DrawOptions& options, Frame& frame,
                         const RunContext& context);

}  // namespace organbake
