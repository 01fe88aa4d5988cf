// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <vector>

#include "organbake/bundle/lighting.h"
#include "organbake/image/channel_image.h"
#include "organbake/shading/frame_depth.h"
#include "organbake/shading/grid.h"
#include "organbake/shading/prepared_frame.h"

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

// A frame's tissue without the light that it was taken in.
struct FrameAlbedo {
  // sRGB; black where there is no tissue. Scaled so that tissue at the median range that faces the
  // light is as bright as in the frame: one picture tells no absolute albedo.
  Rgb8Image color;
  double reference_mm = 0;  // that range, in the unit of the depth
  // How much of the light is left: correlation of ln luminance with ln 1/r² and with ln cos over
  // the pixels that count, −1…1. The frame's own stand beside them.
  double falloff_left = 0, cosine_left = 0;
  double falloff_before = 0, cosine_before = 0;
};

// The light of a laparoscope as shading models it: 1/r² from its place beside the lens and its
// beam, for a player to light the albedo anew. Metered from each view, as a camera exposes by
// itself. The model is Lambert's, so the light is not softened. Tissue of which a share of the
// shape is known shines the less.
Lighting laparoscope_lighting(const LaparoscopeOptions& options, double known_share = 1);
// And back: where such a light sits beside the lens, and its beam. Throws BadDataError naming
// `name` for one without a light at the scope.
LaparoscopeOptions lamp_of(const Lighting& lighting, const std::string& name);

// Divides the frame by the light on the surface that was found in it, as far as its noise allows.
// Highlights, the glow around them and what a camera cut off take the hue and the brightness of
// their surroundings. `mm_per_unit` of the depth.
// Throws BadDataError where no tissue counts.
FrameAlbedo divide_light_out(const PreparedFrame& frame, const FrameDepth& depth,
                             const LaparoscopeOptions& options, double mm_per_unit);

// Colours that were found at a reduced frame's size (`color`, sRGB, as divide_light_out() gives
// them), in the pixels of the frame before it was halved so many times: with that frame's detail
// wherever the reduced one is diffuse tissue. `frame` is undistorted as the reduced one is. Throws
// BadDataError when `color` is not of the reduced frame's size.
[[nodiscard]] Rgb8Image with_own_pixels(const Rgb8Image& color, const PreparedFrame& reduced,
                                        const Rgb8Image& frame, int halvings);

}  // namespace organbake
