// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "organbake/geometry/camera.h"
#include "organbake/truth/lens_picture.h"
#include "organbake/warp/frame.h"

namespace organbake {

// The colours of the wall that paint_cavity_wall() paints, at every few pixels of a picture from
// the scene's eye through some lens, and between them in proportion: its folds are wider. It is dim
// and blurred, so that small squares of a large picture have one colour each.
class CavityWall {
 public:
  CavityWall(const DrawnScene& scene, const Intrinsics& lens,
             const std::array<std::uint8_t, 3>& behind);

  int square_px() const { return square_px_; }
  // Of all pixels of a row of squares, from its first on: sRGB, and room after the last.
  std::vector<std::uint8_t> colors_of(int first_row, int width) const;
  // Whether a frame shows the wall: nothing of its own, in the colour `behind`.
  bool shows(const Frame& frame, int x, int y) const {
    return !frame.covered(x, y) && is_behind(frame.color.at(x, y));
  }
  // By how many of the four pixels from one on to the right and down.
  int shown_in(const Frame& frame, int x, int y) const {
    int count = 0;
    for (int row = 0; row < 2; ++row) {
      const Cover* const cover = &frame.cover[std::size_t(y + row) * frame.color.width + x];
      const std::uint8_t* const rgb = frame.color.at(x, y + row);
      count += int((cover[0] == Cover::background) & is_behind(rgb)) +
               int((cover[1] == Cover::background) & is_behind(rgb + 3));
    }
    return count;
  }

 private:
  bool is_behind(const std::uint8_t* rgb) const {
    return ((rgb[0] ^ behind_[0]) | (rgb[1] ^ behind_[1]) | (rgb[2] ^ behind_[2])) == 0;
  }
  Eigen::Array4f seen_along(const Eigen::Vector3f& ray) const;  // 0…255

  std::array<std::uint8_t, 3> behind_;
  Eigen::Vector3f eye_, center_;  // world; of the sphere, from the eye
  float radius_ = 0, full_mm2_ = 0;
  int square_px_, step_px_;
  int columns_;
  std::vector<Eigen::Array4f> nodes_;
};

}  // namespace organbake
