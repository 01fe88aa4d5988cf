// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <vector>

#include "image/channel_image.h"

namespace organbake {

// What a pixel of a frame shows.
enum class Cover : std::uint8_t { background = 0, samples, base, filled, solid };

// What skin a pixel shows, at rest, world mm; not a number where it is not told.
struct Shown {
  Eigen::Vector3f point_mm;   // whose colour it is
  Eigen::Vector3f sample_mm;  // of the sample that it was drawn from
};

inline const Shown kNothingShown = {Eigen::Vector3f::Constant(std::nanf("")),
                                    Eigen::Vector3f::Constant(std::nanf(""))};

// A drawn picture. The caller keeps it between frames: a Warper that finds its own last picture in
// it, and nothing changed, leaves it alone.
struct Frame {
  Rgb8Image color;
  std::vector<Cover> cover;     // one per pixel
  std::vector<float> depth_mm;  // planar z, +inf at the background; empty unless asked for
  std::vector<Shown> shown;     // one per pixel; empty unless asked for
  std::uint64_t serial = 0;     // of the drawing it holds; set to 0 to force a redraw

  bool covered(int x, int y) const {
    return cover[std::size_t(y) * color.width + x] != Cover::background;
  }
};

}  // namespace organbake
