// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "light/skin_light.h"
#include "organbake/bundle/lighting.h"

namespace organbake {

// Colour finer than the maps, SkinFinish::grain: three octaves of solid noise, bound to the skin at
// rest, each as far as a pixel can show it.
class SkinGrain {
 public:
  explicit SkinGrain(const SkinFinish& finish)
      : shares_{static_cast<float>(finish.grain[0]), static_cast<float>(finish.grain[1]),
                static_cast<float>(finish.grain[2])},
        grain_mm_(finish.grain.maxCoeff() > 0 ? static_cast<float>(finish.grain_mm) : 0) {}

  // Whether any shows on skin at that depth, however little: a pixel must not depend on those that
  // are lit with it. inverse_pixel: pixels to a mm at depth 1 mm.
  bool shows(float depth_mm, float inverse_pixel) const;
  // Multiplies colours by it, of which no skin is nearer than nearest_mm.
  void add(const ScopeSkin& skin, const ScopeSkinAtRest& at_rest, float inverse_pixel,
           float nearest_mm, const SpanColors& colors) const;

  static constexpr int kOctaves = 3;
  static constexpr float kOctaveStep = 0.47f;

 private:
  std::array<float, 3> shares_;  // deviation by channel
  float grain_mm_;               // 0: none
};

}  // namespace organbake
