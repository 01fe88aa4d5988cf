// SPDX-License-Identifier: Apache-2.0
#include "tissue_look.h"

#include <cmath>
#include <cstdint>

namespace organbake {
namespace {

// −1…1, of a cell of a regular grid.
double cell_value(std::int64_t x, std::int64_t y, std::int64_t z) {
  std::uint64_t h = static_cast<std::uint64_t>(x) * 0x9E3779B97F4A7C15u ^
                    static_cast<std::uint64_t>(y) * 0xC2B2AE3D27D4EB4Fu ^
                    static_cast<std::uint64_t>(z) * 0x165667B19E3779F9u;
  h ^= h >> 31, h *= 0xBF58476D1CE4E5B9u, h ^= h >> 29, h *= 0x94D049BB133111EBu, h ^= h >> 32;
  return static_cast<double>(h >> 11) * 0x1p-52 - 1;
}

// Smooth between cells (value noise).
double noise(const Eigen::Vector3d& at) {
  std::int64_t cell[3];
  double t[3];
  for (int c = 0; c < 3; ++c) {
    const double floor = std::floor(at[c]), share = at[c] - floor;
    cell[c] = static_cast<std::int64_t>(floor);
    t[c] = share * share * (3 - 2 * share);
  }
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    double weight = 1;
    std::int64_t place[3];
    for (int c = 0; c < 3; ++c) {
      const int far = corner >> c & 1;
      place[c] = cell[c] + far;
      weight *= far ? t[c] : 1 - t[c];
    }
    sum += weight * cell_value(place[0], place[1], place[2]);
  }
  return sum;
}

constexpr double kCapsule_mm = 0.35;
// Below the lips a fresh cut is wet with blood, and little light comes down between them.
constexpr double kWet_mm = 2.2;
constexpr float kWetDarkness = 0.72f;
const Eigen::Vector3f kCapsule(0.60f, 0.40f, 0.32f);  // connective tissue with little blood

}  // namespace

Eigen::Vector3f inner_albedo(const Eigen::Vector3d& at_mm, double depth_mm,
                             const Eigen::Vector3f& skin_albedo) {
  const double mottled =
      0.5 * noise(at_mm / 6.0) + 0.3 * noise(at_mm / 2.3) + 0.2 * noise(at_mm / 1.1);
  const double fibres = noise({at_mm.x() / 1.4, at_mm.y() / 7.0, at_mm.z() / 1.4});
  const auto light = static_cast<float>(0.66 * (1 + 0.45 * mottled + 0.25 * fibres));
  const auto wet = static_cast<float>(std::exp(-std::pow(depth_mm / kWet_mm, 2)));
  const Eigen::Vector3f inner = (1 - kWetDarkness * wet) * light *
                                skin_albedo.cwiseProduct(Eigen::Vector3f(1.0f, 0.62f, 0.62f));
  // Right below the skin lies its pale capsule, here thinner, there thicker.
  const double capsule_mm = kCapsule_mm * (1 + 0.5 * noise(at_mm / 2.5));
  const auto pale = static_cast<float>(std::exp(-std::pow(depth_mm / capsule_mm, 2)));
  return (1 - 0.4f * pale) * inner + 0.2f * pale * (skin_albedo + kCapsule);
}

}  // namespace organbake
