// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>

#include "light/skin_light.h"
#include "organbake/bundle/lighting.h"
#include "organbake/warp/view.h"

namespace organbake {

// What a span of skin is to the light at the scope, by pixel.
struct ScopeSkin {
  alignas(64) float depth_mm[kSpan];  // planar z; any where there is no skin
  SkinDirections normals;             // now, world, any length; 0 where there is no skin
};
// Where that skin lies at rest.
struct ScopeSkinAtRest {
  SkinDirections normals, places_mm;
};

// What is worked out for all pixels, and asked for again where gloss may show.
struct ScopeLit {
  alignas(64) float share[kSpan];   // of full exposure
  alignas(64) float shows[kSpan];   // 0…1, of gloss
  SkinDirections normal, half_way;  // unit
};

// Lights skin by a ScopeLight with a SkinFinish, pixel by pixel:
//   albedo · E soft(n·l) + E wet Σ lobes strength · D(n'·h) + E rim (1 − n·e)⁵,
// with E the light's share there, h half-way between light and eye. The lobes
// are GGX (Walter et al. 2007) of the width α² = 2 / (exponent + 2) that a
// Blinn lobe has, D(1) = 1.
//
// The relief of n' is a sum of plane waves of random directions through the
// skin at rest, turned with it by the least rotation that takes its normal
// there; so a poke carries it, and it does not crawl. Waves too short for a
// pixel widen the lobes by the variance of their slopes instead (Toksvig 2005):
// a highlight seen from afar keeps its light and does not flicker.
class ScopeShine {
 public:
  explicit ScopeShine(const Lighting& lighting);

  // Takes a view, and the range of full exposure there.
  void look(const View& view, double reference_mm);

  // `colors` hold the albedo × weight before, and what is seen but for the
  // gloss after. Whether gloss may show anywhere.
  bool light(const ScopeSkin& skin, const SpanColors& colors, ScopeLit& lit) const;
  void add_gloss(const ScopeLit& lit, const ScopeSkin& skin, const ScopeSkinAtRest& at_rest,
                 const SpanColors& colors) const;

  static constexpr int kFine = 8, kCoarse = 4, kMostLobes = 4;

  // As plain numbers, so that the loops over pixels see constants.
  struct Wave {
    float x, y, z, phase;  // turns per mm, and at the origin
    float slope_x, slope_y, slope_z;
    float length_mm, variance;  // of the slope along one direction
    float bend = 0;             // turns, of fine waves by coarse ones
  };
  struct Lobe {
    float strength, alpha2;
  };
  struct Frame {
    std::array<float, 3> right, down, origin;  // a pixel's ray, of depth 1
    std::array<float, 3> light, forward;       // from the eye, mm; the view's axis
    float full = 1;                            // gain · reference², mm²
    float inverse_tan2_half = 1;
    float inverse_pixel = 1;  // at depth 1
  };

 private:
  ScopeLight scope_;
  SkinFinish finish_;
  std::array<Wave, kFine + kCoarse> waves_{};
  std::array<Lobe, kMostLobes> lobes_{};
  float least_cosine_ = 1;  // of a normal to half-way, for gloss to show; above 1: never
  Frame frame_;
};

}  // namespace organbake
