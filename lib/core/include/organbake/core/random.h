// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace organbake {

// A small random stream (SplitMix64; Steele, Lea, Flood 2014) that belongs to one item, never to a
// thread: RandomStream(seed, item) gives the same numbers whoever works on the item. Satisfies
// UniformRandomBitGenerator; use its own members rather than <random>'s distributions, whose
// results differ between standard libraries.
class RandomStream {
 public:
  using result_type = std::uint64_t;

  explicit RandomStream(std::uint64_t seed, std::uint64_t item = 0);
  static constexpr result_type min() { return 0; }
  static constexpr result_type max() { return ~result_type{0}; }
  result_type operator()();

  double uniform();                          // in [0, 1)
  double uniform(double low, double high);   // in [low, high)
  double normal();                           // mean 0, standard deviation 1 (Box–Muller)
  std::uint64_t below(std::uint64_t count);  // in 0 … count−1; count > 0

 private:
  std::uint64_t state_;
};

}  // namespace organbake
