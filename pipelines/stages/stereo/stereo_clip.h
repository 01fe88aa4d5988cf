// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "organbake/shading/beam_estimate.h"
#include "organbake/shading/frame_source.h"
#include "organbake/stereo/stereo_depth.h"
#include "stages/shared/clip_outputs.h"
#include "stages/stereo/options.h"

namespace organbake {

// What the report keeps of a pair of pictures besides.
struct PairRecord {
  FrameRecord frame;
  double matched_share = 0, filled_share = 0, covered_share = 0, relative_sd = 0;
  double rows_apart_px = 0;
  RowAlignment corrected;
};

struct StereoClipResult {
  std::vector<PairRecord> records;
  BeamEstimate beam;  // of the lamp, taken to lie at the left lens; unless its light is kept
  std::optional<KeyFrame> key;  // the left eye's
};

// Decodes, rectifies, matches and writes pairs at the same time, a few in memory at once. A pair's
// depth depends on no other pair.
StereoClipResult match_clip(FrameSelection& frames, const Rectifier& rectifier,
                            const EyeInsets& insets, const StereoStageOptions& options,
                            const std::filesystem::path& folder, const RunContext& context);

}  // namespace organbake
