// SPDX-License-Identifier: GPL-3.0-or-later
// The organ as a formula: a star-shaped body of lobes in closed form and bumps of solid noise, with
// gradients, so that rays find the surface by safe steps along them; and its albedo as a solid
// texture, from tissue tones up to vessels, fat and the gallbladder.
#include <algorithm>
#include <array>
#include <cmath>

#include "formulas.h"
#include "organbake/capture/solid_noise.h"
#include "organbake/geometry/refine.h"

namespace organbake {
namespace {

constexpr double kBaseRadiusMm = 50.6;  // R0: with the lobes the paper's face count
constexpr double kBumpMm = 1.6;         // times the noise's ±0.45: bumps of 0.4–0.8 mm
constexpr double kBroadShare = 0.6;     // of the bumps, the rest is fine
constexpr double kBroadCellMm = 9.0, kFineCellMm = 5.5;
constexpr double kLargestBumpShare = 0.03;  // of R0 s: keeps tiny organs organs

struct Lobe {
  Eigen::Vector3d toward;  // LPS: x left, y posterior, z superior
  double height, sharpness;
  Eigen::Vector3d across;
  double narrowness;
};

// No two of them mirror each other in any axis: a flipped or transposed organ is seen at once.
constexpr int kNamedLobes = 8;
const std::array<Lobe, kNamedLobes> kLiver = {{
    {{-0.88, 0.25, 0.10}, 0.46, 2.2, {0, 0, 1}, 0.0},        // right lobe
    {{0.90, -0.30, 0.22}, 0.85, 5.0, {0.1, 0.35, 1}, 3.0},   // left lobe, flat
    {{-0.35, 0.10, 0.90}, 0.14, 3.5, {0, 0, 1}, 0.0},        // dome
    {{-0.62, -0.30, -0.75}, 0.34, 7.0, {0, 1, 0}, 3.0},      // lower tip
    {{0.36, -0.78, -0.42}, -0.24, 9.0, {1, 0, 0.45}, 12},    // groove between the lobes
    {{0.36, 0.35, -0.85}, -0.34, 3.2, {0, 0, 1}, 0.0},       // hollow below
    {{-0.12, -0.62, -0.78}, 0.20, 14., {1, 0.2, 0.1}, 24.},  // gallbladder
    {{0.10, 0.95, 0.20}, -0.16, 5.0, {1, 0, 0}, 6.0},        // groove at the spine
}};

Lobe jittered(Lobe lobe, RandomStream& random) {
  lobe.toward = (lobe.toward.normalized() + 0.08 * random_direction(random)).normalized();
  lobe.height *= random.uniform(0.9, 1.1);
  return lobe;
}

Lobe random_lobe(RandomStream& random) {
  const Eigen::Vector3d toward = random_direction(random), across = random_direction(random);
  const double sharpness = random.uniform(10, 24), height = random.uniform(-0.05, 0.05);
  return {toward, height, sharpness, across, random.uniform(0, 8)};
}

}  // namespace

OrganShape::OrganShape(std::uint64_t seed, double scale, const Eigen::Vector3d& center_mm)
    : center_mm_(center_mm),
      scale_(scale),
      bump_mm_(std::min(kBumpMm, kLargestBumpShare * kBaseRadiusMm * scale)),
      broad_bumps_(RandomStream(seed, seed_items::kBroadBumps)(), kBroadCellMm),
      fine_bumps_(RandomStream(seed, seed_items::kFineBumps)(), kFineCellMm) {
  for (int k = 0; k < kLobes; ++k) {
    RandomStream random(seed, seed_items::kFirstLobe + k);
    const Lobe lobe = k < kNamedLobes ? jittered(kLiver[k], random) : random_lobe(random);
    toward_.row(k) = lobe.toward;
    across_.row(k) = lobe.across.normalized();
    height_[k] = lobe.height;
    sharpness_[k] = lobe.sharpness;
    narrowness_[k] = lobe.narrowness;
  }
  measure();
}

double OrganShape::smooth_radius(const Eigen::Vector3d& direction) const {
  const LobeValues along = (toward_ * direction).array();
  const LobeValues aside = (across_ * direction).array();
  const LobeValues bell = (sharpness_ * (along - 1) - narrowness_ * aside.square()).exp();
  return scale_ * kBaseRadiusMm * (1 + (height_ * bell).sum());
}

double OrganShape::bump(const Eigen::Vector3d& offset_mm) const {
  return bump_mm_ * (kBroadShare * broad_bumps_.value(offset_mm) +
                     (1 - kBroadShare) * fine_bumps_.value(offset_mm));
}

Eigen::Vector3d OrganShape::surface_point(const Eigen::Vector3d& direction) const {
  const double smooth = smooth_radius(direction);
  return center_mm_ + (smooth + bump(smooth * direction)) * direction;
}

double OrganShape::value(const Eigen::Vector3d& world_mm) const {
  const Eigen::Vector3d offset = world_mm - center_mm_;
  const double distance = offset.norm();
  const Eigen::Vector3d direction =
      distance > 0 ? Eigen::Vector3d(offset / distance) : Eigen::Vector3d::UnitZ();
  const double smooth = smooth_radius(direction);
  return smooth + bump(smooth * direction) - distance;
}

OrganShape::Sample OrganShape::sample(const Eigen::Vector3d& world_mm) const {
  const Eigen::Vector3d offset = world_mm - center_mm_;
  const double distance = offset.norm();
  if (!(distance > 0)) return {value(world_mm), Eigen::Vector3d::Zero()};
  const Eigen::Vector3d d = offset / distance;
  const auto tangential = [&](const Eigen::Vector3d& g) -> Eigen::Vector3d {
    return (g - d * d.dot(g)) / distance;
  };

  const LobeValues along = (toward_ * d).array(), aside = (across_ * d).array();
  const LobeValues bell = height_ * (sharpness_ * (along - 1) - narrowness_ * aside.square()).exp();
  const double base = scale_ * kBaseRadiusMm;
  const double smooth = base * (1 + bell.sum());
  const Eigen::Vector3d smooth_gradient =
      tangential(base * (toward_.transpose() * (bell * sharpness_).matrix() -
                         across_.transpose() * (2 * bell * narrowness_ * aside).matrix()));

  // y = R(d) d moves with x by d ∇Rᵀ + R (I − d dᵀ) / ρ.
  const NoiseSample broad = broad_bumps_.sample(smooth * d), fine = fine_bumps_.sample(smooth * d);
  const double noise = kBroadShare * broad.value + (1 - kBroadShare) * fine.value;
  const Eigen::Vector3d slope =
      kBroadShare * broad.gradient_per_mm + (1 - kBroadShare) * fine.gradient_per_mm;
  const Eigen::Vector3d bump_gradient =
      bump_mm_ * (d.dot(slope) * smooth_gradient + smooth * tangential(slope));
  return {smooth + bump_mm_ * noise - distance, smooth_gradient + bump_gradient - d};
}

void OrganShape::measure() {
  constexpr int kSubdivisions = 4;  // 2,562 directions, 4.6° apart: wider than a bump, hence:
  constexpr double kSlopeMargin = 1.25;
  inner_radius_mm_ = scale_ * kBaseRadiusMm * 10;
  double steepest = 1;
  for (const Eigen::Vector3d& direction : make_icosphere(kSubdivisions).vertices) {
    const Eigen::Vector3d point = surface_point(direction);
    const double radius = (point - center_mm_).norm();
    inner_radius_mm_ = std::min(inner_radius_mm_, radius);
    outer_radius_mm_ = std::max(outer_radius_mm_, radius);
    steepest = std::max(steepest, sample(point).gradient.norm());
  }
  lipschitz_ = kSlopeMargin * steepest;
  inner_radius_mm_ -= 2 * bump_mm_ + 0.02 * outer_radius_mm_;
  outer_radius_mm_ += 2 * bump_mm_ + 0.02 * outer_radius_mm_;
}

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
