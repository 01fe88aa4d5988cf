// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "warp/pixel_box.h"
#include "warp/wide.h"

namespace organbake {

// Depth of the skin that each pixel of a picture shows, mm; +inf where it shows none, and for some
// pixels round the picture, so that whoever looks at a pixel's neighbours need not ask whether they
// exist.
class SkinDepth {
 public:
  static constexpr int kMargin = 2;  // rows, and columns, that can be asked beyond each border

  // Forgets all when the size changes.
  void resize(int width, int height) {
    if (width == width_ && height == height_) return;
    width_ = width, height_ = height;
    depth_mm_.assign(std::size_t(stride()) * (height + 2 * kMargin),
                     std::numeric_limits<float>::infinity());
  }
  int width() const { return width_; }
  int height() const { return height_; }
  float* row(int y) { return depth_mm_.data() + first_of(y); }
  const float* row(int y) const { return depth_mm_.data() + first_of(y); }
  void clear(const PixelBox& box) {
    for (int y = box.y0; y < box.y1; ++y)
      std::fill(row(y) + box.x0, row(y) + box.x1, std::numeric_limits<float>::infinity());
  }

 private:
  // Beyond a row whole vectors can be read.
  static constexpr int kAside = kMargin + static_cast<int>(kLanes);
  int stride() const { return width_ + 2 * kAside; }
  std::size_t first_of(int y) const { return std::size_t(stride()) * (y + kMargin) + kAside; }

  int width_ = 0, height_ = 0;
  std::vector<float> depth_mm_;
};

}  // namespace organbake
