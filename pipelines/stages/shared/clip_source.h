// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>

#include "organbake/core/run_context.h"
#include "organbake/geometry/camera.h"
#include "organbake/shading/frame_source.h"
#include "organbake/shading/grid.h"

namespace organbake {

// A clip's frames as they are shaded, and the lens that belongs to their pixels.
struct ShadeSource {
  FrameSelection::NextFrame next;
  std::optional<Intrinsics> camera;  // nothing = none is given
};

// A frame (PNG, JPEG, EXR), a folder of frames or a video; `lens` as read_intrinsics() takes it, or
// null. Frames come with square pixels and upright as their files ask, unless the lens is of the
// pixels as they are stored (told by its size, else by its fx : fy). What is done so is said.
// Throws NoInputError, BadDataError.
ShadeSource open_frames(const std::filesystem::path& frames, const std::filesystem::path* lens,
                        const RunContext& context);

// What a recorder has laid into a clip's frames (InsetFinder), by reading up to two thousand of
// them beforehand, up to a damaged one; of no size where there is nothing.
Mask insets_of(const FrameSelection::NextFrame& next, const RunContext& context);
// The same of frames as open_frames() gives them.
Mask insets_of(const std::filesystem::path& frames, const std::filesystem::path* lens,
               const RunContext& context);

}  // namespace organbake
