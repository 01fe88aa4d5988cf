// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "organbake/image/channel_image.h"

namespace organbake {

// Frames of a clip that show one thing: `first` up to and with `last`.
struct ClipSpan {
  std::size_t first = 0, last = 0;
  // 0…1: how much of a shape it can tell. Up to SpanFinder::kShadingAlone: tissue is seen, but by
  // shading alone; 0: none is.
  double worth = 0;
  std::string reason;  // why it is not worth it, or what speaks for it
};

struct SpanOptions {
  double shortest_s = 2, longest_s = 12;  // of a span that is worth baking
};

// Finds in a long video, in one pass, the spans in which a scope moves over steady tissue: looked
// at in a few small pictures a second, whose features are followed. What is blurred, out of the
// body, covered by instruments, seen by a scope that stands still or turns only, or moves by itself
// is told apart. Deterministic; memory does not grow with the video but by its list of spans.
class SpanFinder {
 public:
  static constexpr double kShadingAlone = 0.02;

  explicit SpanFinder(const SpanOptions& options = {});
  ~SpanFinder();

  // The next picture that is looked at, of any one size: the clip's frame of that number, and when
  // it is shown. Three a second tell enough.
  void add(std::size_t frame, double time_s, const Rgb8Image& picture);
  // All spans in the order of the clip.
  std::vector<ClipSpan> take();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace organbake
