// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "appearance/photo_pyramid.h"
#include "appearance/prediction.h"
#include "color/tissue_light.h"
#include "cost_functions/ncc_cost.h"
#include "organbake/image/channel_image.h"

namespace organbake {

// ln of red over green and of green over blue, of a level's pixels: no light of one colour changes
// them, so they tell of what the tissue is. Row by row; means over the pixels of the photograph
// that are not blown.
std::vector<Eigen::Vector2f> log_hues(const Rgb8Image& photo, const PhotoLevel& level);

// The hues of some pixels as numbers of about unit size: both, centred on the organ's own, their
// squares and their product. Where all has one colour they stay small, so that noise is no hue.
std::vector<TissueLight::Hues> hue_numbers(const PhotoLevel& level,
                                           const std::vector<Eigen::Vector2f>& hues,
                                           const Prediction& prediction,
                                           const std::vector<WeightedPixel>& pixels);

}  // namespace organbake
