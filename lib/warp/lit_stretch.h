// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "warp/skin_light.h"
#include "warp/sum_stretch.h"

namespace organbake {

// Light changes slowly over skin that runs on: of each eight pixels of a row it is worked out for
// three, and mixed between them; for every pixel where the skin breaks off or falls away steeply.
// Groups lie at multiples of eight of the picture's columns, so that a pixel's light does not
// depend on which part of the picture is drawn.
class LitStretch {
 public:
  static constexpr int kGroup = 8;
  // Neighbours whose depths differ by more texels than this lie beside a break, or on skin that is
  // seen at a grazing angle.
  static constexpr float kSmoothTexels = 4;

  // depth_mm: of the stretch's skin, +inf where none is to be lit; its first column is a multiple
  // of kGroup. smooth_mm: kSmoothTexels of them.
  LitStretch(const float* depth_mm, int count, float smooth_mm);

  // The pixels whose light is asked for, by their place in the stretch, ascending.
  int post_count() const { return post_count_; }
  int post(int k) const { return posts_[k]; }

  // Lights `count` pixels of the planes: colour · gain + white · gloss. light: of `skin`, which are
  // posts of this stretch; posts that are not among them keep their light. x0: the stretch's first
  // column.
  void light(const SkinPixels& skin, const SkinLight& light, int x0, const float* white, int count,
             const std::array<float*, 3>& planes) const;

 private:
  static constexpr int kGroups = kStretch / kGroup;
  std::array<bool, kGroups> smooth_{};
  int post_count_ = 0;
  std::array<std::int32_t, kStretch> posts_;
};

}  // namespace organbake
