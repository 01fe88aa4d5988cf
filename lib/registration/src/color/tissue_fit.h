// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <limits>
#include <vector>

#include "appearance/photo_pyramid.h"
#include "color/tissue_light.h"
#include "organbake/registration/registered_surface.h"

namespace organbake {

// A level of a photograph of living tissue.
struct TissueLevel {
  const PhotoLevel& photo;
  std::vector<Eigen::Vector2f> hues;  // tissue_colors.h
  double dark = 0.01;  // luminance added before the logarithm, so that black does not outweigh all
};

struct TissueFit {
  ObjectPose pose;
  TissueLight::Weights light = TissueLight::expected().mean;
  double noise = 0;  // robust standard deviation of ln luminance about the fit
  // What the fit leaves of ln luminance, far pixels capped, with the penalty for light and motion
  // that are not expected: of several fits on one level the lowest is the likeliest.
  double cost = std::numeric_limits<double>::infinity();
  double pixels = 0;   // of the level that the cost is a mean of, by their trust
  bool usable = true;  // the surface is in the picture
};

// Gauss–Newton over pose, light and hue at once, the overlap drawn anew at every step. The start
// holds the pose, as softly as 10 mm and 7°: what a flat patch cannot tell stays as it was given.
// Albedo that shading and hue leave unexplained is noise that neighbours share, so that pixels
// count as far fewer than they are.
void climb_tissue(const RegisteredSurface& surface, const TissueLevel& level,
                  const ObjectPose& start, int steps, TissueFit& fit);

}  // namespace organbake
