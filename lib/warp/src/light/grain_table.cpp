// SPDX-License-Identifier: Apache-2.0
#include "light/grain_table.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace organbake {
namespace {

double fade(double t) { return t * t * t * (t * (t * 6 - 15) + 10); }

// The gradient at a corner of the lattice, which repeats, along the way from there.
double ramp(const std::array<int, 3>& corner, const std::array<double, 3>& way) {
  std::uint32_t h = 40;
  for (const int at : corner)
    h = (h ^ static_cast<std::uint32_t>(at % GrainTable::kGrains)) * 0x85ebca6bu + 0x9e3779b9u;
  h = (h ^ (h >> 13)) * 0xc2b2ae35u;
  h ^= h >> 16;
  double sum = 0;
  for (int k = 0; k < 3; ++k) sum += (((h >> (10 * k)) & 1023u) * (2.0 / 1023) - 1) * way[k];
  return sum;
}

double noise_at(const std::array<double, 3>& grains) {
  double sum = 0;
  for (int c = 0; c < 8; ++c) {
    std::array<int, 3> corner{};
    std::array<double, 3> way{};
    double weight = 1;
    for (int k = 0; k < 3; ++k) {
      const int up = c >> k & 1, low = static_cast<int>(grains[k]);
      corner[k] = low + up;
      way[k] = grains[k] - corner[k];
      weight *= up ? fade(grains[k] - low) : 1 - fade(grains[k] - low);
    }
    sum += weight * ramp(corner, way);
  }
  return sum;
}

}  // namespace

GrainTable::GrainTable() {
  constexpr double kNoiseDeviation = 0.19;
  values_.reserve(std::size_t(kSide) * kSide * kSide);
  const auto at = [](int k) { return (k + 0.5) / kPerGrain; };
  for (int x = 0; x < kSide; ++x)
    for (int y = 0; y < kSide; ++y)
      for (int z = 0; z < kSide; ++z) {
        const double value = kDeviation / kNoiseDeviation * noise_at({at(x), at(y), at(z)});
        values_.push_back(static_cast<std::int8_t>(std::lround(std::clamp(value, -127.0, 127.0))));
      }
}

const GrainTable& GrainTable::shared() {
  static const GrainTable table;
  return table;
}

}  // namespace organbake
