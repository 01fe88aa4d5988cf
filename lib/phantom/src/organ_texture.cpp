// SPDX-License-Identifier: GPL-3.0-or-later
#include "organ_texture.h"

#include <algorithm>
#include <cmath>

#include "organ_random.h"
#include "organbake/capture/solid_noise.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

const Vector3d kDarkTissue{0.145, 0.024, 0.016}, kLightTissue{0.255, 0.050, 0.031};
const Vector3d kLobuleWall{0.330, 0.108, 0.074};
const Vector3d kDarkVessel{0.100, 0.012, 0.022}, kPaleVessel{0.420, 0.165, 0.120};
const Vector3d kFat{0.610, 0.415, 0.165};
const Vector3d kBileDark{0.095, 0.170, 0.040}, kBileLight{0.250, 0.330, 0.095};

constexpr double kDriftCellMm = 24, kLobuleCellMm = 5.0, kMottlingCellMm = 2.6;
constexpr double kDarkVesselCellMm = 21, kPaleVesselCellMm = 13, kVisibilityCellMm = 27;
constexpr double kVesselHalfWidthMm =
    0.95;                            // of the Gaussian profile: 1.6 mm across at half height
constexpr double kWallShare = 0.21;  // of the noise's range that counts as a lobule's wall
constexpr int kFatSpots = 10;

Vector3d mix(const Vector3d& a, const Vector3d& b, double share) { return a + share * (b - a); }

// 1 on the zero set of the noise, 0 a few millimetres away. |value| / |gradient| is the distance
// to first order; where the gradient fades the band would widen into a blot, so it is kept up.
double band(const NoiseSample& noise, double cell_mm, double half_width_mm) {
  const double least_slope = 0.5 / cell_mm;
  const double slope = std::sqrt(noise.gradient_per_mm.squaredNorm() + least_slope * least_slope);
  const double distance = noise.value / slope / half_width_mm;
  return std::exp(-distance * distance);
}

SolidNoise texture_noise(std::uint64_t seed, int index, double cell_mm) {
  return {RandomStream(seed, seed_items::kTexture + index)(), cell_mm};
}

}  // namespace

OrganTexture::OrganTexture(std::uint64_t seed, const OrganShape& shape)
    : center_mm_(shape.center_mm()),
      scale_(shape.scale()),
      drift_(texture_noise(seed, 0, kDriftCellMm)),
      lobules_(texture_noise(seed, 1, kLobuleCellMm)),
      mottling_(texture_noise(seed, 2, kMottlingCellMm)),
      dark_vessels_(texture_noise(seed, 3, kDarkVesselCellMm)),
      pale_vessels_(texture_noise(seed, 4, kPaleVesselCellMm)),
      visibility_(texture_noise(seed, 5, kVisibilityCellMm)),
      gallbladder_axis_(Vector3d(-0.25, -0.70, 0.67).normalized()) {
  const Vector3d toward = Vector3d(-0.12, -0.62, -0.78).normalized();  // the shape's bulge
  gallbladder_at_mm_ = shape.surface_point(toward) - center_mm_;
  for (int i = 0; i < kFatSpots; ++i) {
    RandomStream random(seed, seed_items::kFirstFatSpot + i);
    const Vector3d on_surface = shape.surface_point(random_direction(random)) - center_mm_;
    fat_spots_.push_back({on_surface, scale_ * random.uniform(4, 9)});
  }
}

Vector3d OrganTexture::tissue(double drift, double lobule, double mottle) const {
  const Vector3d ground = mix(kDarkTissue, kLightTissue, smooth_step(-0.45, 0.45, drift));
  // A lobule is where the noise stays on one side of zero; its wall is the zero set.
  const double wall = std::exp(-lobule * lobule / (kWallShare * kWallShare));
  return mix(ground * (1 + 0.45 * lobule + 0.55 * mottle), kLobuleWall, 0.15 * wall);
}

// Patches with ragged borders that dissolve into the lobules.
double OrganTexture::fat(const Vector3d& offset_mm, double ragged) const {
  double share = 0;
  for (const Spot& spot : fat_spots_) {
    const double reach = (offset_mm - spot.offset_mm).norm() / spot.radius_mm;
    if (reach < 2) share = std::max(share, 1 - smooth_step(0.3, 1.1, reach + ragged));
  }
  return share;
}

double OrganTexture::gallbladder(const Vector3d& offset_mm, double ragged) const {
  const Vector3d from = (offset_mm - gallbladder_at_mm_) / scale_;
  const double along = from.dot(gallbladder_axis_);
  const double aside = (from - along * gallbladder_axis_).norm();
  const double pear = 11.5 - 0.16 * along;  // wider at its lower end
  return 1 -
         smooth_step(0.86, 1.0, Eigen::Vector2d(along / 25, aside / pear).norm() + 0.16 * ragged);
}

Vector3d OrganTexture::albedo(const Vector3d& world_mm) const {
  const Vector3d offset = world_mm - center_mm_;
  const double drift = drift_.value(offset), visible = visibility_.value(offset);
  const double lobule = lobules_.value(offset), mottle = mottling_.value(offset);
  const NoiseSample pale = pale_vessels_.sample(offset), dark = dark_vessels_.sample(offset);

  Vector3d color = tissue(drift, lobule, mottle);
  const double pale_share = 0.28 * smooth_step(-0.15, 0.25, visible);
  const double dark_share = 0.75 * smooth_step(-0.10, 0.30, -visible);
  color = mix(color, kPaleVessel, pale_share * band(pale, kPaleVesselCellMm, kVesselHalfWidthMm));
  color = mix(color, kDarkVessel, dark_share * band(dark, kDarkVesselCellMm, kVesselHalfWidthMm));
  color =
      mix(color, kFat * (1 + 0.5 * mottle), 0.75 * fat(offset, 1.2 * pale.value + 0.7 * lobule));
  const Vector3d bile = mix(kBileDark, kBileLight, smooth_step(-0.4, 0.4, pale.value));
  color = mix(color, bile, 0.92 * gallbladder(offset, dark.value));
  return color.cwiseMax(0.0).cwiseMin(1.0);
}

}  // namespace organbake
