// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "appearance/photo_pyramid.h"
#include "appearance/prediction.h"
#include "organbake/image/channel_image.h"
#include "organbake/registration/register_photo.h"

namespace organbake {

constexpr int kColorKinds = 5;
// How much of a pixel is of each kind; sums to 1.
using KindShares = std::array<float, kColorKinds>;

// What surrounds an organ's start in a photograph, its pixels told apart by kinds of colour.
struct ColorScene {
  PhotoLevel level;  // the lens of the piece that was cut out; no luminance
  std::vector<KindShares> kinds;
  double radius_px = 0;  // of the organ at its start

  // Nothing where the piece has next to no pixels.
  static ColorScene around(const RegisteredSurface& surface, const PhotoToRegister& photo,
                           const ObjectPose& start);
  bool empty() const { return kinds.empty(); }
};

// How much of each pixel of the piece the organ covers at a pose, blurred by a Gaussian.
std::vector<float> covered(const RegisteredSurface& surface, const PhotoLevel& level,
                           const ObjectPose& pose, double blur_px);

// How likely each pixel shows the organ, by its colour alone, when the organ is taken to cover so
// much of each. A kind that fills as much of the organ as of what surrounds it, such as something
// in front that hides both, gives 0.5: it tells nothing, for or against any pose.
std::vector<float> likely_organ(const ColorScene& scene, const std::vector<float>& cover);

}  // namespace organbake
