// SPDX-License-Identifier: Apache-2.0
// Random numbers by SplitMix64 (Steele, Lea, Flood 2014). Distributions are our own, because those
// of the standard library give other numbers on other systems: normal ones by Box and Muller's
// formula, whole ones by Lemire's multiplication.
#include "organbake/core/random.h"

#include <cmath>
#include <numbers>

namespace organbake {
namespace {

__extension__ using Wide = unsigned __int128;

std::uint64_t mix(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
  return z ^ (z >> 31);
}

}  // namespace

// Seed and item are mixed apart first, so that neighbouring items start far from each other.
RandomStream::RandomStream(std::uint64_t seed, std::uint64_t item)
    : state_(mix(mix(seed + 0x9E3779B97F4A7C15u) ^ (item * 0xD1B54A32D192ED03u))) {}

RandomStream::result_type RandomStream::operator()() {
  state_ += 0x9E3779B97F4A7C15u;
  return mix(state_);
}

double RandomStream::uniform() { return static_cast<double>((*this)() >> 11) * 0x1p-53; }

double RandomStream::uniform(double low, double high) { return low + (high - low) * uniform(); }

double RandomStream::normal() {
  const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));  // 1 − u is never 0
  return radius * std::cos(2.0 * std::numbers::pi * uniform());
}

std::uint64_t RandomStream::below(std::uint64_t count) {
  // Lemire's multiply-shift; its bias (< count / 2⁶⁴) is far below anything measured here.
  return static_cast<std::uint64_t>((static_cast<Wide>((*this)()) * count) >> 64);
}

}  // namespace organbake
