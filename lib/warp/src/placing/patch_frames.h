// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

#include "organbake/warp/view.h"
#include "placing/chunk_frame.h"
#include "placing/placed_faces.h"
#include "samples/patch.h"

namespace organbake {

// Where patches lie in a frame, whichever their faces are: `count` of them from `first` on, at most
// kPatchBatch.
inline constexpr int kPatchBatch = 64;
void place_patches(const PatchTable& patches, std::size_t first, int count,
                   std::span<const FaceFrame> faces, const View& view, ChunkFrame* frames);

// The patch's outward normal at its middle, unnormalised, where a face's shell matrix puts it.
Eigen::Vector3d patch_normal(const Patch& patch, const ShellMatrix& face);

}  // namespace organbake
