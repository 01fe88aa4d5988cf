// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/motion/lens_spread.h"

#include <cmath>

#include "organbake/core/parallel.h"

namespace organbake {
namespace {

constexpr std::size_t kParts = 4;

// The lens as all but one part of the posed views have it.
Intrinsics lens_without(std::size_t part, const FreeLens& free, Scene scene) {
  const std::size_t posed = scene.posed_views();
  std::size_t at = 0;
  for (auto& pose : scene.camera_from_world) {
    if (!pose) continue;
    if (at++ * kParts / posed == part) pose.reset();
  }
  adjust({.lens = free, .iterations = 12, .sightings_per_view = 150}, scene);
  return scene.lens;
}

}  // namespace

LensSpread lens_spread(const FreeLens& free, const Scene& scene) {
  if (!free.any() || scene.posed_views() < 2 * kParts) return {};
  std::vector<Intrinsics> lenses(kParts);
  parallel_for(std::size_t{0}, kParts,
               [&](std::size_t part) { lenses[part] = lens_without(part, free, scene); });
  const auto spread = [&](double Intrinsics::*figure) {
    double mean = 0, squares = 0;
    for (const Intrinsics& lens : lenses) mean += lens.*figure / kParts;
    for (const Intrinsics& lens : lenses) squares += std::pow(lens.*figure - mean, 2);
    return std::sqrt(squares * (kParts - 1) / kParts);
  };
  return {spread(&Intrinsics::fx), spread(&Intrinsics::k1), spread(&Intrinsics::cx),
          spread(&Intrinsics::cy)};
}

}  // namespace organbake
