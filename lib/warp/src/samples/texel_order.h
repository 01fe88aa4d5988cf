// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "organbake/bundle/bundle.h"

namespace organbake {

// The texels of one chunk: texels[first … first + count).
struct TexelRun {
  std::uint32_t face = 0;
  std::uint32_t first = 0, count = 0;
};

struct TexelOrder {
  std::vector<std::uint32_t> texels;  // row-major indices of the texels in use
  std::vector<TexelRun> runs;         // by face
};

// Sorts a map's texels by face and, within a face, along a Morton curve of 8 × 8 tiles, and cuts
// the result into runs that stay compact in the map: at most kChunk texels within 16 × 16.
TexelOrder order_texels(const CameraMaps& maps);

}  // namespace organbake
