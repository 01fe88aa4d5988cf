// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "organbake/core/run_context.h"
#include "organbake/shading/frame_source.h"
#include "organbake/shading/prepared_frame.h"
#include "stages/stereo/options.h"

namespace organbake {

// The eyes' pictures, two by two: each picture of the clip is the left one with the right one to
// its right.
struct EyeSource {
  FrameSelection::NextFrame next;
  PixelSize eye;            // of one eye's picture
  std::string left, right;  // file names
};

// Two pictures, folders or videos, or one (`right` null) that holds both eyes in each frame. Throws
// NoInputError; BadDataError for eyes of unlike size, for a frame that holds one picture, and
// (from next) when one clip ends before the other.
EyeSource open_eyes(const std::filesystem::path& left, const std::filesystem::path* right,
                    const StereoStageOptions& options, const RunContext& context);

// The halves of such a picture.
StoredPicture left_of(const StoredPicture& both);
StoredPicture right_of(const StoredPicture& both);

}  // namespace organbake
