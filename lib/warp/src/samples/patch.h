// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <span>
#include <vector>

namespace organbake {

// How far normals lean from a middle one. They lean a little more once their face bends.
struct NormalCone {
  float sine = 0, cosine = 1;  // of the widest angle

  NormalCone() = default;
  explicit NormalCone(float widest_rad) {
    constexpr float kBend_rad = 0.15f;
    const float angle = std::min(widest_rad + kBend_rad, std::numbers::pi_v<float>);
    sine = std::sin(angle), cosine = std::cos(angle);
  }
};

// A small piece of one camera's map over one proxy face, described in the face's shell coordinates
// (b1, b2, h): enough to place, measure and cull it under any deformation without its samples.
struct Patch {
  std::uint32_t face = 0;
  float center[3] = {};   // b1, b2, h
  float extent[3] = {};   // half sizes about the centre
  float along_u[3] = {};  // change of (b1, b2, h) per texel column …
  float along_v[3] = {};  // … and per row
  NormalCone cone;        // of the samples' normals, about the patch's
};

// Patches as structure of arrays: a camera has tens of thousands, and each is placed in every
// frame.
class PatchTable {
 public:
  // What a patch is but for its face: center, extent, along_u, along_v, the cone's sine and cosine.
  static constexpr int kNumbers = 14;
  std::uint32_t face(std::size_t patch) const { return faces_[patch]; }

  PatchTable() = default;
  explicit PatchTable(std::span<const Patch> patches);
  // One number of each patch; beyond the last, whole vectors can be read.
  const float* number(int k) const { return numbers_[k].data(); }

 private:
  std::vector<std::uint32_t> faces_;
  std::array<std::vector<float>, kNumbers> numbers_;
};

}  // namespace organbake
