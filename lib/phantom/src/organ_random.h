// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "organbake/core/random.h"

namespace organbake {

// Which random stream of the phantom's seed belongs to what. Part of the frozen formula: a changed
// number is another organ.
namespace seed_items {
inline constexpr std::uint64_t kBroadBumps = 1;
inline constexpr std::uint64_t kFineBumps = 2;
inline constexpr std::uint64_t kTexture = 3;  // the first of six noises
inline constexpr std::uint64_t kFirstLobe = 100;
inline constexpr std::uint64_t kFirstFatSpot = 200;
inline constexpr std::uint64_t kFirstScanRow = 1u << 20;  // one stream per row of voxels
}  // namespace seed_items

// Uniform over the unit sphere.
inline Eigen::Vector3d random_direction(RandomStream& random) {
  const double z = random.uniform(-1, 1), angle = random.uniform(0, 2 * std::numbers::pi);
  const double r = std::sqrt(1 - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

}  // namespace organbake
