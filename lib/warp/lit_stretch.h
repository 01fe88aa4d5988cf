// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "warp/sum_stretch.h"

namespace organbake {

// What light depends on changes slowly over skin that runs on: of each eight pixels of a row it is
// worked out for three, and mixed between them; for every pixel where the skin breaks off or falls
// away steeply. Groups lie at multiples of eight of the picture's columns, so that a pixel's light
// does not depend on which part of the picture is drawn.
class LitStretch {
 public:
  static constexpr int kGroup = 8;

  // depth_mm: of the stretch's skin, +inf where none is to be lit; its first column is a multiple
  // of kGroup. texel_mm: of the cameras, on the surface.
  LitStretch(const float* depth_mm, int count, float texel_mm);

  // The pixels that are asked for, by their place in the stretch, ascending.
  int post_count() const { return post_count_; }
  int post(int k) const { return posts_[k]; }

  // Mixes the other pixels of a plane whose posts are set. Equal numbers stay what they are.
  void mix(float* plane) const;

 private:
  std::array<bool, kStretch / kGroup> smooth_{};
  int post_count_ = 0;
  std::array<std::int32_t, kStretch> posts_;
};

}  // namespace organbake
