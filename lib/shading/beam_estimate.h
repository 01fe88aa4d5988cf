// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <vector>

#include "shading/frame_depth.h"

namespace organbake {

// How a lamp at the lens falls off to the sides.
struct BeamEstimate {
  double exponent = 0;  // of cosⁿ of the angle to the optical axis, vignette included
  double sd = 0;        // its standard deviation, by how far sectors of the picture disagree
  int sectors = 0;      // that told it; 0: none did, and exponent and sd say nothing

  // Whether it is known well enough to be divided out: an unlucky texture would do more harm.
  bool told() const;
};

// Learns the beam from frames whose shape is known by other means than their shading, which a beam
// would have bent already. What Lambert's law and 1/r² leave of the brightness is the albedo times
// the beam; texture is averaged over sectors, rings and frames.
class BeamEstimator {
 public:
  // Normals are taken from the depth, smoothed: matching errs from pixel to pixel.
  void add(const PreparedFrame& frame, const Plane& depth, const Plane& confidence);
  BeamEstimate estimate() const;

  static constexpr int kSectors = 8, kRings = 12;
  // Of one frame: by sector and ring the median of what is left of ln brightness, NaN where too
  // little counts; may be found for several frames at once.
  using Rings = std::array<std::array<float, kRings>, kSectors>;
  struct FrameRings {
    Rings left;
    Rings log_cosine;  // means over the same pixels
  };
  static FrameRings rings_of(const PreparedFrame& frame, const Plane& depth,
                             const Plane& confidence);
  void add(const FrameRings& rings) { frames_.push_back(rings); }

 private:
  std::vector<FrameRings> frames_;
};

}  // namespace organbake
