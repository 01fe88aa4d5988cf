// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/bundle/lighting.h"
#include "organbake/image/channel_image.h"
#include "organbake/shading/frame_depth.h"
#include "organbake/shading/grid.h"

namespace organbake {

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
// itself. The model is Lambert's, so the light is not softened.
Lighting laparoscope_lighting(const LaparoscopeOptions& options);
// And back: where such a light sits beside the lens, and its beam. Throws BadDataError naming
// `name` for one without a light at the scope.
LaparoscopeOptions lamp_of(const Lighting& lighting, const std::string& name);

// Divides the frame by the light on the surface that was found in it, as far as its noise allows.
// Highlights, the glow around them and what a camera cut off take the hue and the brightness of
// their surroundings. `mm_per_unit` of the depth.
// Throws BadDataError where no tissue counts.
FrameAlbedo divide_light_out(const PreparedFrame& frame, const FrameDepth& depth,
                             const LaparoscopeOptions& options, double mm_per_unit);

}  // namespace organbake
