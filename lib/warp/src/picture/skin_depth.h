// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "organbake/warp/pixel_box.h"
#include "picture/vector_loops.h"

namespace organbake {

// Depth of the skin that each pixel of a picture shows, and nothing round the picture, so that
// whoever looks at a pixel's neighbours need not ask whether they exist. In 65,535 levels: they
// tell skin from the skin behind it, which needs no more, and a picture's depths are written and
// read in every frame, which half the bytes make faster.
class SkinDepth {
 public:
  using Level = std::uint16_t;
  static constexpr Level kNothing = 0xFFFF, kFarthest = 0xFFFE;
  static constexpr int kMargin = 2;  // rows, and columns, that can be asked beyond each border

  // Skin from reach_mm on has the same level. A change of size forgets all; after a change of reach
  // all has to be put anew.
  void resize(int width, int height, float reach_mm);
  int width() const { return width_; }
  int height() const { return height_; }
  float level_mm() const { return level_mm_; }
  const Level* row(int y) const { return levels_.data() + first_of(y); }
  // Depths of pixels from (x, y) on along a row, to be read up to whole vectors; +inf: no skin.
  void put(int x, int y, int count, const float* depth_mm);
  void clear(const PixelBox& box) {
    for (int y = box.y0; y < box.y1; ++y) std::fill(at(box.x0, y), at(box.x1, y), kNothing);
  }

 private:
  // Beyond a row whole vectors can be read, of twice as many levels as other numbers.
  static constexpr int kAside = kMargin + 2 * static_cast<int>(kLanes);
  int stride() const { return width_ + 2 * kAside; }
  std::size_t first_of(int y) const { return std::size_t(stride()) * (y + kMargin) + kAside; }
  Level* at(int x, int y) { return levels_.data() + first_of(y) + x; }

  int width_ = 0, height_ = 0;
  float level_mm_ = 1;
  std::vector<Level> levels_;
};

}  // namespace organbake
