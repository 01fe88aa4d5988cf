// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "appearance/prediction.h"
#include "cost_functions/ncc_cost.h"

namespace organbake {

// The overlap T of one prediction with a photograph: pixels of the organ and of a band beside it,
// fixed while the solver runs, so that it cannot raise R by showing less.
// band: pixels beyond the outline. Nothing for an organ outside the picture. Of an open surface the
// pixels at and beyond its cuts are no part of it, and those near them count less: what lies there
// is not known.
std::vector<WeightedPixel> overlap(const PhotoLevel& level, const Prediction& prediction, int band);

struct Appearance {
  ShadingBasis::Weights light = ShadingBasis::Weights::Zero();  // in the photograph's luminance
  double offset = 0;
  double noise = 0;         // robust standard deviation of what is left
  double inlier_share = 0;  // of T's pixels on the organ
};

// Least squares of the photograph over T by the basis and an offset; pixels far off (instruments,
// highlights, a cluttered background) get less weight, which is also written into T. A light that
// would turn bright into dark is refused: the basis' first weights then stand.
Appearance fit_appearance(const PhotoLevel& level, const Prediction& prediction,
                          const ShadingBasis& basis, std::vector<WeightedPixel>& pixels);

// Photograph less prediction of T's pixels on the organ, by a light that is fitted to the other
// half of the picture's squares of `side` pixels: the white squares predict the black ones and the
// other way round. Weights as they are.
std::vector<double> held_out_residuals(const PhotoLevel& level, const Prediction& prediction,
                                       const ShadingBasis& basis,
                                       const std::vector<WeightedPixel>& pixels, int side);

// Geman & McClure 1987: the weight of a residual whose square is `off2` times that of the cutoff. 1
// for what fits, a quarter at the cutoff, nothing far beyond.
inline double robust_weight(double off2) { return 1 / ((1 + off2) * (1 + off2)); }

}  // namespace organbake
