// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "organbake/image/channel_image.h"
#include "organbake/shading/grid.h"

namespace organbake {

// Shrinks (grows) what is non-zero by a square of 2·radius + 1 pixels; the frame's edge is no edge.
[[nodiscard]] Mask eroded(const Mask& mask, int radius);
[[nodiscard]] Mask dilated(const Mask& mask, int radius);

// Pixels of both; of one and not of the other.
[[nodiscard]] Mask common(Mask a, const Mask& b);
[[nodiscard]] Mask without(Mask a, const Mask& b);
// Of another size in pixels; each takes the value of the pixel that lies nearest to it.
[[nodiscard]] Mask at_size(const Mask& mask, int width, int height);

// The largest 4-connected region of non-zero pixels, as ones.
[[nodiscard]] Mask largest_region(const Mask& mask);
// Zeros that are not 4-connected to the frame's edge become ones.
[[nodiscard]] Mask with_holes_closed(const Mask& mask);
// The 4-connected regions of `mask` that hold a pixel of `seeds`.
[[nodiscard]] Mask regions_touching(const Mask& mask, const Mask& seeds);

// The part of a frame that the endoscope's stop lets through: what is joined to the largest region
// that is not black, its holes closed (blood and shadows are tissue), with what is as dark as a
// border but passes into it without a step, shrunk by `margin_px`.
// Letters and logos on the black border are other regions and fall away. A frame without a black
// border is all inside. A black frame gives an empty mask.
[[nodiscard]] Mask field_of_view(const Rgb8Image& frame, int margin_px);

// Mirror reflections of the light on moist tissue: pixels that are saturated, or clearly brighter
// and whiter than what lies round them (a window of about a tenth of the frame), beyond the frame's
// noise, among its whitest and no wider than a highlight, with the rim that coding and blooming
// leave. Non-zero = highlight.
[[nodiscard]] Mask find_highlights(const Rgb8Image& frame, const Mask& inside);

// Shafts of metal and plastic: strips between two straight, sharp borders that come in from the rim
// of what is inside, longer than wide, greyer than what lies on both sides of them (of the
// picture's own usual hue: pale, smoky and tinted pictures are the same here), and streaked along.
// What is doubtful stays tissue. Non-zero = instrument. Nothing where the picture is_colourless().
[[nodiscard]] std::optional<Mask> find_instruments(const Rgb8Image& frame, const Mask& inside);

// Whether the usual hue of all that is lit is grey. Colour then tells nothing.
[[nodiscard]] bool is_colourless(const Rgb8Image& frame, const Mask& inside);

// Finds what a recorder has laid into the frames of a clip, which is no tissue: a second picture,
// still (an ultrasound image) or live (another camera), bars of text, logos, frozen panels. A clip
// that does not move tells none, nor does one of fewer than kFewest frames. Looks at some frames
// spread over the clip, so that its memory does not grow with it; deterministic.
class InsetFinder {
 public:
  static constexpr std::size_t kFewest = 4;

  // The next frame of the clip, of any one size.
  void add(const Rgb8Image& frame);
  // Of the frames' size, non-zero = an inset; of no size where there is none.
  Mask find() const;

 private:
  std::vector<Rgb8Image> samples_;  // halved to at most 960 pixels
  std::size_t count_ = 0, stride_ = 1;
  int width_ = 0, height_ = 0;
};

// The share of the pixels that are non-zero; 0 of no pixels.
double share_of(const Mask& mask);

// What to say of insets that cover this share of the frames.
std::string told_of_insets(double share);

}  // namespace organbake
