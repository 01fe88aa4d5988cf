// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "organbake/truth/flow.h"
#include "organbake/truth/layer_set.h"
#include "organbake/truth/pixel_truth.h"

namespace organbake {

// Pieces of work that write one file each, from planes of their own: whoever makes them may run
// them later, and from any thread.
using WriteJob = std::function<void()>;

// Of the layers but for flow, as <before>depth<after>.exr, normals, id and weight likewise, and
// the mask as PNG of 8-bit labels. Channels: Z, as floats of 24 bits (to 0.001 mm
// at 100 mm); X Y Z; organ face b1 b2 h (face 4294967295 and the rest 0 at the background); weight.
// The jobs throw IoError.
std::vector<WriteJob> layer_jobs(const std::filesystem::path& folder, const std::string& before,
                                 const std::string& after, const LayerSet& layers,
                                 const PixelTruth& truth);

// The same, at once.
void write_layers(const std::filesystem::path& folder, const std::string& before,
                  const std::string& after, const LayerSet& layers, const PixelTruth& truth);

// flow as EXR: forward.x forward.y forward.seen and backward likewise, px to 1/256 as half floats
// (to one part in 4096), and 0 or 1; of a picture that is the first or the last one of the two is
// missing; without both there is no file.
std::vector<WriteJob> flow_jobs(const std::filesystem::path& file, int width, int height,
                                const Flow* forward, const Flow* backward);

}  // namespace organbake
