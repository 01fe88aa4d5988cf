// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "warp/frame.h"
#include "warp/outline_areas.h"
#include "warp/pixel_box.h"
#include "warp/skin_bits.h"

namespace organbake {

// Smooths the border between skin and background, which takes one sample a pixel: from the steps of
// the border follows about where the outline runs between them, and with it the share of each pixel
// that skin covers (Reshetov 2009, "Morphological antialiasing"). Both sides of the border are
// blended with the background by that share, in linear light. Covers stay as they are.
//
// Where skin meets skin or a tool nothing is smoothed.
class Outline {
 public:
  // skin: the frame's, with a border; looked at here alone. Forgets what it softened before.
  void soften(const SkinBits& skin, const std::array<std::uint8_t, 3>& background, Frame& frame);
  // drawn: all pixels that have skin.
  void soften(const PixelBox& drawn, const std::array<std::uint8_t, 3>& background, Frame& frame);
  // The frame as it was before soften().
  void undo(Frame& frame) const;

 private:
  struct Pixel {
    std::uint32_t at;
    std::array<std::uint8_t, 3> color;
  };
  struct Border;
  void follow_rows();
  void follow_columns();
  void follow(const Border& border);
  bool is_border(const Border& border, int i) const;
  double rise_of(const Border& border, int length, BorderStep ends) const;
  void change(PixelAt pixel, double share);
  void blend(const Pixel& pixel, const std::array<float, 3>& background, Frame& frame) const;

  const SkinBits* bits_ = nullptr;  // while softening
  int width_ = 0;
  // By how much more of a pixel, or less, skin covers than its centre says, in steps of 1/254; 0
  // between calls.
  std::vector<std::int8_t> change_;
  std::vector<Pixel> softened_;  // as they were
};

}  // namespace organbake
