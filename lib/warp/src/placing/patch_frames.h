// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>

#include "organbake/warp/view.h"
#include "placing/chunk_frame.h"
#include "placing/placed_faces.h"
#include "samples/patch.h"

namespace organbake {

// Where patches of one face lie in a frame: `count` of them from `first` on, at most kPatchBatch.
inline constexpr int kPatchBatch = 64;
void place_patches(const PatchTable& patches, std::size_t first, int count, const FaceFrame& face,
                   const View& view, ChunkFrame* frames);

// Where the batch ends that begins at `first`: before `last`, of one face.
template <class FaceOf>
std::size_t end_of_batch(std::size_t first, std::size_t last, FaceOf&& face_of) {
  last = std::min(last, first + kPatchBatch);
  std::size_t end = first + 1;
  while (end < last && face_of(end) == face_of(first)) ++end;
  return end;
}

// The patch's outward normal at its middle, unnormalised, where a face's shell matrix puts it.
Eigen::Vector3d patch_normal(const Patch& patch, const ShellMatrix& face);

}  // namespace organbake
