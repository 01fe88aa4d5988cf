// SPDX-License-Identifier: GPL-3.0-or-later
#include "tissue_skin.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "organbake/capture/solid_noise.h"
#include "organbake/core/parallel.h"
#include "vessel_tree.h"

namespace organbake {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kTexel_mm = 0.1;
constexpr int kVesselTrees = 280;
constexpr double kFullAlbedo = std::numeric_limits<std::uint16_t>::max();
constexpr double kFullTilt = std::numeric_limits<std::int16_t>::max();

const Vector3d kLiverAlbedo(0.24, 0.062, 0.045), kGallbladderAlbedo(0.44, 0.31, 0.19),
    kFatAlbedo(0.58, 0.38, 0.15);
// What a vessel on each leaves of its light.
const Vector3d kOnLiver(0.58, 0.52, 0.52), kOnGallbladder(0.62, 0.24, 0.22),
    kOnFat(0.55, 0.2, 0.25);

// Mottling: features of these lengths, of these weights.
struct Octave {
  double length_mm, weight;
};
constexpr std::array<Octave, 6> kOctaves = {
    {{9, 0.7}, {4.6, 0.8}, {2.2, 0.9}, {1.1, 0.9}, {0.55, 0.8}, {0.3, 0.6}}};
constexpr double kNoiseDeviation = 0.19;  // of SolidNoise

// About 0, of standard deviation 1.
double mottling_at(std::uint64_t seed, const Vector3d& point) {
  double sum = 0, power = 0;
  for (const Octave& octave : kOctaves) {
    sum += octave.weight * SolidNoise(++seed, octave.length_mm).value(point);
    power += octave.weight * octave.weight;
  }
  return sum / (kNoiseDeviation * std::sqrt(power));
}

// Fine vessels run where a noise is zero: a net of meshes some millimetres wide.
double net_at(std::uint64_t seed, const Vector3d& point) {
  constexpr double kMesh_mm = 3.2, kHalfWidth = 0.022;
  const double away = std::abs(SolidNoise(seed, kMesh_mm).value(point));
  return std::clamp(1.5 - away / kHalfWidth, 0.0, 1.0);
}

// The film's slopes: of humps a millimetre wide and some hundredths of it high.
Vector2d film_tilt(std::uint64_t seed, const Vector3d& point) {
  constexpr double kCoarse_mm = 1.3, kCoarseHeight_mm = 0.14, kFine_mm = 0.5, kFineHeight_mm = 0.02;
  const Vector3d slope =
      kCoarseHeight_mm * SolidNoise(seed, kCoarse_mm).sample(point).gradient_per_mm +
      kFineHeight_mm * SolidNoise(seed + 1, kFine_mm).sample(point).gradient_per_mm;
  return slope.head<2>();
}

Vector3d albedo_at(const Vector3d& share, double light, double vessel) {
  const Vector3d tissue =
      share[0] * kLiverAlbedo + share[1] * kGallbladderAlbedo + share[2] * kFatAlbedo;
  const Vector3d left = share[0] * kOnLiver + share[1] * kOnGallbladder + share[2] * kOnFat;
  return light * tissue.cwiseProduct(Vector3d::Ones() - vessel * (Vector3d::Ones() - left));
}

}  // namespace

TissueSkin::TissueSkin(const TissueRelief& relief, std::uint64_t seed, double mottling)
    : columns_(static_cast<int>(2 * TissueRelief::kReachX_mm / kTexel_mm) + 2),
      rows_(static_cast<int>(2 * TissueRelief::kReachY_mm / kTexel_mm) + 2),
      texels_(static_cast<std::size_t>(columns_) * rows_) {
  std::vector<float> vessels(texels_.size(), 0.0f);
  if (mottling > 0) paint_vessels(seed, vessels);
  parallel_for(0, rows_, [&](int row) {
    for (int column = 0; column < columns_; ++column) {
      const std::size_t k = static_cast<std::size_t>(row) * columns_ + column;
      texels_[k] = texel(relief, column * kTexel_mm - TissueRelief::kReachX_mm,
                         row * kTexel_mm - TissueRelief::kReachY_mm, seed, mottling, vessels[k]);
    }
  });
}

TissueSkin::Texel TissueSkin::texel(const TissueRelief& relief, double x_mm, double y_mm,
                                    std::uint64_t seed, double mottling, double vessel) {
  const std::uint64_t stream = 64 * seed;
  const Vector3d point(x_mm, y_mm, relief.at(x_mm, y_mm).z_mm);
  const Vector3d share = relief.tissues(x_mm, y_mm);
  const double net = mottling > 0 ? 0.55 * net_at(stream + 30, point) : 0;
  // The liver's vessels lie below its capsule.
  const double deep = 1 - 0.5 * share[0];
  const Vector3d albedo = albedo_at(share, std::exp(mottling * mottling_at(stream, point)),
                                    deep * std::max(vessel, net));
  const Vector2d tilt = film_tilt(stream + 40, point);
  Texel result{};
  for (int c = 0; c < 3; ++c)
    result.albedo[c] =
        static_cast<std::uint16_t>(std::lround(kFullAlbedo * std::clamp(albedo[c], 0.0, 1.0)));
  for (int axis = 0; axis < 2; ++axis)
    result.tilt[axis] =
        static_cast<std::int16_t>(std::lround(kFullTilt * std::clamp(tilt[axis], -1.0, 1.0)));
  return result;
}

void TissueSkin::paint_vessels(std::uint64_t seed, std::vector<float>& coverage) const {
  constexpr double kSoft_mm = 0.09;  // half the width of a vessel's border
  const Vector2d reach(TissueRelief::kReachX_mm, TissueRelief::kReachY_mm);
  for (const VesselSpot& spot : grow_vessels(seed, kVesselTrees, reach)) {
    const Vector2d middle = (spot.center_mm + reach) / kTexel_mm;
    const double outside = (spot.radius_mm + kSoft_mm) / kTexel_mm;
    const auto first = [&](double m) { return std::max(0, static_cast<int>(m - outside)); };
    const auto last = [&](double m, int count) {
      return std::min(count - 1, static_cast<int>(m + outside) + 1);
    };
    for (int row = first(middle.y()); row <= last(middle.y(), rows_); ++row)
      for (int column = first(middle.x()); column <= last(middle.x(), columns_); ++column) {
        const double away = kTexel_mm * std::hypot(column - middle.x(), row - middle.y());
        const double covered =
            std::clamp((spot.radius_mm + kSoft_mm - away) / (2 * kSoft_mm), 0.0, 1.0);
        float& texel = coverage[static_cast<std::size_t>(row) * columns_ + column];
        texel = std::max(texel, static_cast<float>(covered));
      }
  }
}

TissueSkin::Sample TissueSkin::at(double x_mm, double y_mm) const {
  const double u = std::clamp((x_mm + TissueRelief::kReachX_mm) / kTexel_mm, 0.0, columns_ - 1.001);
  const double v = std::clamp((y_mm + TissueRelief::kReachY_mm) / kTexel_mm, 0.0, rows_ - 1.001);
  const int column = static_cast<int>(u), row = static_cast<int>(v);
  Sample sample{Vector3d::Zero(), Vector2d::Zero()};
  for (int corner = 0; corner < 4; ++corner) {
    const int right = corner & 1, down = corner >> 1;
    const double weight = (right ? u - column : 1 - u + column) * (down ? v - row : 1 - v + row);
    const Texel& texel = texels_[static_cast<std::size_t>(row + down) * columns_ + column + right];
    for (int c = 0; c < 3; ++c) sample.albedo[c] += weight / kFullAlbedo * texel.albedo[c];
    for (int axis = 0; axis < 2; ++axis)
      sample.film_tilt[axis] += weight / kFullTilt * texel.tilt[axis];
  }
  return sample;
}

}  // namespace organbake
