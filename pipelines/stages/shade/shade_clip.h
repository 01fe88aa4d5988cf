// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "organbake/shading/frame_source.h"
#include "stages/shade/options.h"
#include "stages/shared/clip_outputs.h"

namespace organbake {

// A clip and how it was taken.
struct Clip {
  FrameSelection frames;
  std::optional<Intrinsics> camera;  // nothing = the assumed field of view
  std::optional<Mask> instruments;
  Mask insets = {};  // of the frames' size, where there are any
};

struct ClipResult {
  std::vector<FrameRecord> records;
  std::optional<KeyFrame> key;
  StoredPicture key_picture;  // before it was halved and undistorted; its lens is the clip's
};

// The lens of a frame of the clip: as given, or the assumed field of view.
Intrinsics lens_of(const Clip& clip, const ShadeStageOptions& options, const Rgb8Image& frame);

// Decodes, prepares, shades and writes frames at the same time, a few in memory at once. Depths do
// not depend on how many threads there are: each frame starts from the one before it, in order.
ClipResult shade_clip(Clip& clip, const ShadeStageOptions& options,
                      const std::filesystem::path& folder, const RunContext& context);

}  // namespace organbake
