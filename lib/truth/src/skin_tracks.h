// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "organbake/truth/lens_picture.h"
#include "organbake/truth/pixel_truth.h"

namespace organbake {

// Points of the skin, followed from a clip's first frame through all of it.
class SkinTracks {
 public:
  // count: at most; 0: none, and nothing is done.
  explicit SkinTracks(int count) : wanted_(static_cast<std::size_t>(count)) {}

  // The tracker's last picture; its layers hold flow. seen: what that shows through the lens, or
  // without one as it is.
  void add(const TruthTracker& tracker, const LensPicture* lens, const PixelTruth& seen);
  // Of the clip that has ended, if it had any frame: the bytes of an NPZ file.
  std::optional<std::string> take();

 private:
  struct Point {
    std::size_t pixel, organ;
    BoundPixel bound;
  };
  void choose(const PixelTruth& seen);
  template <class Number>
  std::vector<Number> by_point(const std::vector<Number>& by_frame, std::size_t each) const;

  std::size_t wanted_, width_ = 0, frames_ = 0;
  PixelTruth first_;
  Moment first_moment_;
  std::vector<Point> points_;
  std::vector<float> px_, xyz_mm_;  // by frame
  std::vector<std::uint8_t> hidden_;
};

}  // namespace organbake
