// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "finishing/front_edges.h"
#include "organbake/warp/frame.h"

namespace organbake {

// To which side a border between skin and what lies behind it steps at an end of a straight
// stretch; none where it ends.
enum BorderStep : int { to_skin = -1, no_step = 0, to_open = 1 };

// Between an outline and the border that it was sampled to, in one pixel beside the border: how
// much of the pixel behind skin covers, and how much of the skin's it does not.
struct OutlineAreas {
  double of_open = 0, of_skin = 0;
};

// Of a stretch's i-th pixel. The outline lies half a pixel off the border at an end, on the side
// that the border steps to, and is taken for straight from there to the stretch's middle.
OutlineAreas areas_of_slope(int length, BorderStep before, BorderStep after, int i);

// The same for a stretch both of whose ends step to one side: a parabola that rises from them, by
// `rise` pixels in the middle.
OutlineAreas areas_of_bow(int length, BorderStep ends, double rise, int i);

// Smooths the outlines of skin, which take one sample a pixel: from the steps of the border between
// an outline's pixels and those behind it follows about where the outline runs between them, and
// with it the share of each pixel that the skin in front covers (Reshetov 2009, "Morphological
// antialiasing"). Both sides of the border are blended by that share, in linear light. Covers stay
// as they are.
//
// Where skin meets a tool nothing is smoothed: tools take several samples a pixel.
class Outline {
 public:
  // Forgets what it softened before.
  void soften(const FrontEdges& edges, Frame& frame);
  // The frame as it was before soften().
  void undo(Frame& frame) const;

 private:
  using Color = std::array<std::uint8_t, 3>;  // sRGB
  struct Pixel {
    std::uint32_t at;
    Color before, after;
  };
  struct Border;
  // By how much more of a pixel, or less, the skin in front covers than its centre says, in steps
  // of 1/254.
  struct Change {
    std::uint32_t at;
    std::int8_t steps;
  };
  void follow_all();
  void follow_rows(int y, int last, std::vector<Change>& changes) const;
  void follow_columns(FrontEdges::Front front, int y, int last, std::vector<Change>& changes) const;
  void follow(const Border& border, std::vector<Change>& changes) const;
  bool is_border(const Border& border, int i) const;
  double rise_of(const Border& border, int length, BorderStep ends) const;
  void change(const Change& change);
  Color blended(const Pixel& pixel, const Frame& frame) const;

  const FrontEdges* edges_ = nullptr;  // while softening
  int width_ = 0;
  std::vector<std::int8_t> change_;  // by pixel; 0 between calls
  std::vector<Pixel> softened_;
};

}  // namespace organbake
