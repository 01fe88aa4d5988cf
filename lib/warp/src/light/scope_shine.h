// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "light/skin_light.h"
#include "organbake/bundle/lighting.h"
#include "organbake/warp/organ_source.h"
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
//   albedo · E soft(n·l) + E Σ sheen strength · D(n·h) + E wet Σ film strength · D(n'·h)
//   + E rim (1 − n·e)⁵,
// with E the light's share there, h half-way between light and eye. The lobes
// are generalised Trowbridge–Reitz ones (Burley 2012), D(1) = 1: of γ 2 (GGX) and
// the width α² = 2 / (exponent + 2) that a Blinn lobe has, but the film's of γ 4
// and kFilmWidth times that: the ring of fibres has an end, and so have its
// pictures. Wide ones are the tissue's own sheen, bluish as
// light is that comes back from the uppermost layers; narrow ones a film of
// water's.
//
// The film follows the lobules below: each cell of a jittered lattice
// (nearest_cell.h) is a low dome that leans a little, so that it mirrors the
// light in one round drop if at all, and many side by side are a cluster of
// them; the smoother the skin, the less of the film breaks into drops. Hills, plane waves of some
// ten bumps' length, carry them, make some higher, and tell where the film lies at all. Both are
// bound to the skin at rest and turned with it by the least rotation that takes its normal there;
// so a poke carries them, and they do not crawl. Bumps too small for a pixel widen the lobes by the
// variance of their slopes instead (Toksvig 2005): a highlight seen from afar keeps its light and
// does not flicker.
class ScopeShine {
 public:
  explicit ScopeShine(const Lighting& lighting);

  // Takes a view, and the range of full exposure there.
  void look(const View& view, double reference_mm);
  // All of it, for another way of drawing.
  ScopeShading shading() const;
  static std::vector<ShaderConstant> constants();

  // Whether grain shows on skin at that depth, and on it: multiplies colours by it, of which no
  // skin is nearer than nearest_mm.
  bool grain_shows(float depth_mm) const;
  void add_grain(const ScopeSkin& skin, const ScopeSkinAtRest& at_rest, float nearest_mm,
                 const SpanColors& colors) const;

  // `colors` hold the albedo × weight before, and what is seen but for the
  // gloss after. Whether gloss may show anywhere.
  bool light(const ScopeSkin& skin, const SpanColors& colors, ScopeLit& lit) const;
  void add_gloss(const ScopeLit& lit, const ScopeSkin& skin, const ScopeSkinAtRest& at_rest,
                 const SpanColors& colors) const;

  static constexpr int kHills = 4, kMostLobes = 4, kOctaves = 3;
  static constexpr double kWidestFilm = 100;                            // exponent
  static constexpr std::array<float, 3> kSheen = {0.85f, 0.95f, 1.2f};  // RGB
  // Of slopes by the place on a dome (in cells), and by its lean; how sharply the film's patches
  // end.
  static constexpr float kDome = 1.5f, kLean = 0.9f, kPatches = 0.6f;
  // How many bumps of a patch are wet; in squares of cells how far a drop reaches, and within what
  // it ends there and at the next drop, for each pixel more.
  static constexpr float kWetBumps = 2.1f, kDrop = 0.42f, kEdge = 0.17f, kSoftEnds = 2.2f;
  static constexpr float kBlown = 1.1f;  // of full exposure: no mirrored light is brighter
  static constexpr float kFilmWidth = 6;
  static constexpr float kOfBumps = 0.45f;  // of a patch: what bumps and their edges leave wet
  static constexpr double kBreaks = 0.15;   // slope of the relief on which the film is all drops

  // As plain numbers, so that the loops over pixels see constants.
  struct Wave {
    float x, y, z, phase;  // turns per mm, and at the origin
    float slope_x, slope_y, slope_z;
    float length_mm, variance;  // of the slope along one direction
  };
  struct Bumps {
    float per_mm = 1, slope = 0;
  };
  struct Lobe {
    float strength = 0, alpha2 = 1;
  };
  struct Frame {
    std::array<float, 3> right, down, origin;  // a pixel's ray, of depth 1
    std::array<float, 3> light, forward;       // from the eye, mm; the view's axis
    float full = 1;                            // gain · reference², mm²
    float inverse_tan2_half = 1;
    float inverse_pixel = 1;  // at depth 1
  };

 private:
  void take_lobes(const std::vector<Lighting::Lobe>& gloss);

  ScopeLight scope_;
  SkinFinish finish_;
  std::array<Wave, kHills> hills_{};
  Bumps bumps_;
  float rough_ = 0;  // 0…1: share of the film that is drops
  std::array<Lobe, kMostLobes> film_{};
  std::array<Lobe, 2> sheen_{};
  float least_cosine_ = 1;  // of a normal to half-way, for gloss to show; above 1: never
  Frame frame_;
};

}  // namespace organbake
