// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "light/skin_grain.h"
#include "light/skin_light.h"
#include "light/wet_film.h"
#include "organbake/bundle/lighting.h"
#include "organbake/warp/organ_source.h"
#include "organbake/warp/view.h"

namespace organbake {

// Lights skin by a ScopeLight with a SkinFinish, pixel by pixel:
//   albedo · E soft(n·l) + E Σ sheen strength · D(n·h) + E film(n, h) + E rim (1 − n·e)⁵,
// with E the light's share there, h half-way between light and eye, D a generalised
// Trowbridge–Reitz lobe of γ 2 (GGX; Burley 2012), D(1) = 1, of the width α² = 2 / (exponent + 2)
// that a Blinn lobe has. Wide lobes are the tissue's own sheen, bluish as light is that comes back
// from the uppermost layers; narrow ones are the film's (wet_film.h).
class ScopeShine {
 public:
  explicit ScopeShine(const Lighting& lighting);

  // Takes a view, and the range of full exposure there.
  void look(const View& view, double reference_mm);
  // All of it, for another way of drawing.
  ScopeShading shading() const;
  static std::vector<ShaderConstant> constants();

  // Whether grain shows on skin at that depth, and on it: SkinGrain.
  bool grain_shows(float depth_mm) const { return grain_.shows(depth_mm, frame_.inverse_pixel); }
  void add_grain(const ScopeSkin& skin, const ScopeSkinAtRest& at_rest, float nearest_mm,
                 const SpanColors& colors) const {
    grain_.add(skin, at_rest, frame_.inverse_pixel, nearest_mm, colors);
  }

  // `colors` hold the albedo × weight before, and what is seen but for the
  // gloss after. Whether gloss may show anywhere.
  bool light(const ScopeSkin& skin, const SpanColors& colors, ScopeLit& lit) const;
  // Whole vectors from pixel `first` on; their normals are each pixel's own here.
  void add_film(const ScopeSpan& span, unsigned first, int count, const SpanColors& colors) const {
    film_.add(span, frame_.inverse_pixel, first, count, colors);
  }

  static constexpr std::array<float, 3> kSheen = {0.85f, 0.95f, 1.2f};  // RGB

  // As plain numbers, so that the loops over pixels see constants.
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
  WetFilm film_;
  SkinGrain grain_;
  std::array<ShineLobe, 2> sheen_{};
  Frame frame_;
};

}  // namespace organbake
