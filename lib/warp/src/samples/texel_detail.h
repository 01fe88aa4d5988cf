// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "organbake/bundle/bundle.h"
#include "samples/sample_set.h"

namespace organbake {

// What a camera's map says of its texels together with their neighbours on the same surface, for
// all texels at once: whole rows at a time cost a fifth of texel by texel.
struct MapDetail {
  MapDetail(const CameraMaps& maps, double focal_px, bool with_smooth = false);

  std::vector<PackedDetail> texels;  // a TexelDetail each
  std::vector<SmoothDetail> smooth;  // empty unless asked for
  // Change of depth per column and row, mm, by the same differences; NaN without a neighbour.
  std::vector<float> slope_u, slope_v;
};

}  // namespace organbake
