// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <vector>

#include "organbake/shading/frame_depth.h"

namespace organbake {

// What one frame tells of a lamp's beam, if its shape is known by other means than its shading,
// which a beam would have bent already: Lambert's law and 1/r² leave the albedo times the beam of
// the brightness. By sector and ring round the optical axis; NaN where too little counts.
struct BeamRings {
  static constexpr int kSectors = 8, kRings = 12;
  using Rings = std::array<std::array<float, kRings>, kSectors>;
  Rings left;        // medians of ln of what is left
  Rings log_cosine;  // of the angle to the axis, means over the same pixels
};
// Normals are taken from the depth, smoothed: matching errs from pixel to pixel.
BeamRings beam_rings(const PreparedFrame& frame, const Plane& depth, const Plane& confidence);

// How a lamp at the lens falls off to the sides.
struct BeamEstimate {
  double exponent = 0;  // of cosⁿ of the angle to the optical axis, vignette included
  double sd = 0;        // its standard deviation, by how far sectors of the picture disagree
  int sectors = 0;      // that told it; 0: none did, and exponent and sd say nothing

  // Whether it is known well enough to be divided out: an unlucky texture would do more harm.
  bool told() const;
};
// Of frames of one endoscope; texture is averaged over sectors, rings and frames.
BeamEstimate estimate_beam(const std::vector<BeamRings>& frames);

}  // namespace organbake
