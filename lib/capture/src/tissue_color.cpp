// SPDX-License-Identifier: GPL-3.0-or-later
// A tissue's albedo as solid noise of several sizes, and vessels as the zero lines of a noise,
// whose distance is its value over its slope.
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

}  // namespace

TissueAlbedo::TissueAlbedo(const TissueLook& look)
    : look_(look),
      mottle_(kSeed, look.mottle_mm),
      fine_mottle_(kSeed + 1, look.mottle_mm / 2.7),
      tint_(kSeed + 2, 1.7 * look.mottle_mm),
      grain_(kSeed + 3, look.grain_mm),
      fine_grain_(kSeed + 4, look.grain_mm / 1.9),
      bend_(kSeed + 5, 3),
      large_{
          look.large, {kSeed + 6, look.large.spacing_mm}, {kSeed + 7, 1.6 * look.large.spacing_mm}},
      small_{look.small,
             {kSeed + 8, look.small.spacing_mm},
             {kSeed + 9, 2.5 * look.small.spacing_mm}} {}

// Lines run where the noise of their course is zero; their distance is its value over its slope
// along the surface.
float TissueAlbedo::cover_of(const Lines& lines, const Vector3d& point,
                             const Vector3d& normal) const {
  const TissueVessels& vessels = lines.vessels;
  if (!(vessels.share > 0)) return 0;
  const double level = level_of(vessels.share);
  const double shows =
      smooth_step(level, level + 0.6 * kNoiseDeviation, lines.patches.value(point));
  if (!(shows > 0)) return 0;
  const NoiseSample course = lines.course.sample(point);
  const Vector3d along = course.gradient_per_mm - course.gradient_per_mm.dot(normal) * normal;
  const double slope = std::max(along.norm(), 0.02 / vessels.spacing_mm);
  const double away_mm = std::abs(course.value) / slope;
  // Thinner where they begin and end.
  const double half_mm = 0.5 * vessels.width_mm * (0.4 + 0.6 * shows);
  return static_cast<float>(vessels.cover * shows *
                            (1 - smooth_step(0.4 * half_mm, 1.6 * half_mm, away_mm)));
}

Vector3f TissueAlbedo::at(const Vector3d& point, const Vector3d& normal) const {
  constexpr double kUnit = 1 / kNoiseDeviation;
  // Lines wind: their place is bent by a noise of a few millimetres.
  const Vector3d bent = point + 1.2 * bend_.value(point) * Vector3d(1.3, -0.9, 1.1);
  const double tone =
      look_.mottle * kUnit * (0.8 * mottle_.value(point) + 0.6 * fine_mottle_.value(point));
  const double tint = kUnit * tint_.value(bent);
  const double grain = kUnit * (0.8 * grain_.value(point) + 0.6 * fine_grain_.value(point));
  const auto share = static_cast<float>(std::exp(tone));
  Vector3f color = look_.albedo * share;
  color = color.cwiseProduct(Vector3f::Ones() + static_cast<float>(tint) * look_.tint);
  color += static_cast<float>(0.5 * std::clamp(grain, -2.0, 2.5)) * look_.grain;
  for (const Lines* lines : {&small_, &large_}) {
    const float cover = cover_of(*lines, bent, normal);
    color += cover * (lines->vessels.color - color);
  }
  return color.cwiseMax(0.1f * look_.albedo).cwiseMin(1);
}

}  // namespace organbake
