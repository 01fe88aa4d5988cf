// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

namespace organbake {

// Solid gradient noise (Perlin 2002) that repeats in all three directions, as a table to look up:
// next to no energy at lengths below a grain, kPerGrain entries long. Entries are in 1 / kDeviation
// of the noise's deviation. Made once, the same numbers everywhere.
class GrainTable {
 public:
  static constexpr int kBits = 6, kSide = 1 << kBits, kGrains = 10;
  static constexpr float kPerGrain = float(kSide) / kGrains, kDeviation = 40;

  static const GrainTable& shared();
  const std::int8_t* data() const { return values_.data(); }

 private:
  GrainTable();

  std::vector<std::int8_t> values_;  // x slowest, z fastest
};

}  // namespace organbake
