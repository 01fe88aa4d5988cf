// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "bundle/bundle.h"
#include "warp/sample_set.h"

namespace organbake {

// Which of a texel's four neighbours lie on the same surface.
struct SameSurface {
  bool left = false, right = false, up = false, down = false;
};

// One camera's map prepared for neighbour look-ups: colours in 8-bit square-root light, and depth
// continuity. Keeps a reference to the maps.
class MapNeighbours {
 public:
  MapNeighbours(const CameraMaps& maps, double focal_px);

  SameSurface same_surface(std::uint32_t texel) const;
  TexelDetail detail(std::uint32_t texel, const SameSurface& same) const;
  // Change of depth per column and row by the same differences; nullopt-like NaN is never made:
  // a direction without a neighbour reports has_* = false.
  struct Slopes {
    float u = 0, v = 0;
    bool has_u = false, has_v = false;
  };
  Slopes depth_slopes(std::uint32_t texel, const SameSurface& same) const;

 private:
  bool joined(std::uint32_t a, std::uint32_t b) const;

  const CameraMaps& maps_;
  float steepest_;  // largest depth change between neighbours, as a share of the depth
  std::vector<std::array<std::uint8_t, 4>> coded_;
};

}  // namespace organbake
