// SPDX-License-Identifier: GPL-3.0-or-later
// A tissue's albedo as solid noise of several sizes, with vessels at two depths below it, whose
// trees (vessel_tile.h) lie on the planes of the axes: each place sees those of the planes that it
// faces.
#include "tissue_color.h"

#include <algorithm>
#include <cmath>

#include "organbake/capture/smooth_step.h"

namespace organbake {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr std::uint64_t kSeed = 40;       // one look for all bakes
constexpr double kNoiseDeviation = 0.19;  // of SolidNoise

// The value that noise stays below on all but `share` of a surface, if it were normal.
double level_of(double share) {
  // The logistic distribution of the same deviation: within 3 % of the normal one's shares.
  const double kept = std::clamp(share, 1e-3, 1 - 1e-3);
  return kNoiseDeviation * 0.5513 * std::log((1 - kept) / kept);
}

// Pale grains on a darker ground, as lobules and fibres are, rather than dark stains: of deviation
// and mean like the noise's own.
double skewed(double grain) {
  constexpr double kSkew = 0.8, kMean = 1.377, kDeviation = 1.629;  // of exp(kSkew · grain)
  return (std::exp(kSkew * std::min(grain, 3.0)) - kMean) / (kSkew * kDeviation);
}

}  // namespace

TissueAlbedo::TissueAlbedo(const TissueLook& look)
    : look_(look),
      mottles_{SolidNoise(kSeed, look.mottle_mm), SolidNoise(kSeed + 1, look.mottle_mm / 2.3),
               SolidNoise(kSeed + 9, look.mottle_mm / 5.3)},
      tint_(kSeed + 2, 1.7 * look.mottle_mm),
      grain_(kSeed + 3, look.grain_mm),
      fine_grain_(kSeed + 4, look.grain_mm / 1.9),
      bend_(kSeed + 5, 3),
      large_(make_vessels(look.large, kSeed + 6)),
      small_(make_vessels(look.small, kSeed + 8)) {}

TissueAlbedo::Vessels TissueAlbedo::make_vessels(const TissueVessels& look, std::uint64_t seed) {
  constexpr double kSpacings = 9;  // of a tile's side
  Vessels vessels{look, {seed + 1, 2.2 * look.spacing_mm}, nullptr};
  if (look.share > 0)
    vessels.tile =
        std::make_shared<VesselTile>(VesselTreeOptions{.side_mm = kSpacings * look.spacing_mm,
                                                       .spacing_mm = look.spacing_mm,
                                                       .width_mm = look.width_mm,
                                                       .seed = seed});
  return vessels;
}

// Between the planes of two axes vessels fade out, as where they dive.
float TissueAlbedo::cover_of(const Vessels& vessels, const Vector3d& point,
                             const Vector3d& normal) {
  if (!vessels.tile) return 0;
  const double level = level_of(vessels.look.share);
  const double shows = smooth_step(level - 0.3 * kNoiseDeviation, level + 0.5 * kNoiseDeviation,
                                   vessels.patches.value(point));
  if (!(shows > 0)) return 0;
  double sum = 0, weights = 0;
  for (int plane = 0; plane < 3; ++plane) {
    const double facing = normal[plane] * normal[plane], weight = facing * facing * facing;
    weights += weight;
    if (weight < 0.02) continue;
    sum += weight *
           vessels.tile->cover(Eigen::Vector2d(point[(plane + 1) % 3], point[(plane + 2) % 3]));
  }
  return static_cast<float>(vessels.look.cover * shows * sum / std::max(weights, 1e-6));
}

Vector3f TissueAlbedo::at(const Vector3d& point, const Vector3d& normal) const {
  constexpr double kUnit = 1 / kNoiseDeviation;
  // Vessels wind: their place is bent by a noise of a few millimetres.
  const Vector3d bent = point + 1.2 * bend_.value(point) * Vector3d(1.3, -0.9, 1.1);
  const double tone = look_.mottle * kUnit *
                      (0.5 * mottles_[0].value(point) + 0.3 * mottles_[1].value(point) +
                       0.6 * mottles_[2].value(point));
  const double tint = kUnit * tint_.value(bent);
  const double grain = kUnit * (0.8 * grain_.value(point) + 0.4 * fine_grain_.value(point));
  const auto share = static_cast<float>(std::exp(tone));
  Vector3f color = look_.albedo * share;
  color = color.cwiseProduct(Vector3f::Ones() + static_cast<float>(tint) * look_.tint);
  color += static_cast<float>(0.5 * skewed(grain)) * look_.grain;
  for (const Vessels* vessels : {&small_, &large_}) {
    const float cover = cover_of(*vessels, bent, normal);
    color += cover * (vessels->look.color - color);
  }
  return color.cwiseMax(0.1f * look_.albedo).cwiseMin(1);
}

}  // namespace organbake
