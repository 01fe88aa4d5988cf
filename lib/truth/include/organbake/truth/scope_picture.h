// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "organbake/image/channel_image.h"

namespace organbake {

// What a scope's lens and camera make of the light, as a preset tells it: for pictures
// that shall look like an operation's, never for measuring. All of it off unless asked for.
struct ScopePicture {
  double field = 0;        // diameter of the round field, as a share of the width; 0: the whole
  double exposure = 1;     // multiplies the light; what becomes more than 1 is white
  double haze = 0;         // 0…1: share of smoke's even light in the picture
  double bloom = 0;        // 0…1: of blown light, what spreads about it, bluish
  double sharpening = 0;   // 0…5: of what the camera adds at edges, with its dark and light halo
  double grain = 0;        // standard deviation of the noise in mid grey, sRGB levels of 255
  double aperture_mm = 0;  // of the lens: what is out of its focus, amid the picture, blurs; 0: no
  double folds = 0;        // 0…1: how dark folds and the gaps between organs are
  bool surroundings = false;  // a cavity's wall behind the organ (cavity_wall.h)

  // But for what depth tells: what is behind the organ, in folds and out of focus.
  bool off() const {
    return field == 0 && exposure == 1 && haze == 0 && bloom == 0 && sharpening == 0 && grain == 0;
  }
  bool needs_depth() const { return surroundings || aperture_mm > 0 || folds > 0; }
  bool operator==(const ScopePicture&) const = default;
};

// Makes a picture so. The same picture gives the same bytes, on any number of threads; another has
// another noise.
void apply_scope_picture(const ScopePicture& scope, Rgb8Image& picture);
// The same with what its depth tells: folds, and what is out of focus. Planar mm, +inf where there
// is nothing.
void apply_scope_picture(const ScopePicture& scope, double focal_px,
                         const std::vector<float>& depth_mm, Rgb8Image& picture);

}  // namespace organbake
