// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "light/skin_light.h"
#include "organbake/bundle/lighting.h"
#include "organbake/warp/organ_source.h"

namespace organbake {

// The film of water on serosa, as the light at the scope shows it. On smooth skin it is whole and
// follows the hills: plane waves of some ten bumps' length. The rougher the skin, the more of it
// breaks into drops: low domes round strewn points (strewn_cells.h), each leaning a little, so that
// it mirrors the light as one round dot if at all, and many side by side are a cluster. Hills make
// some higher, and tell where drops lie at all. All of it is bound to the skin at rest and turned
// with it by the least rotation that takes its normal there; so a poke carries it, and it does not
// crawl.
//
// What is finer than a pixel is filtered, so that far is the mean of near and nothing flickers: a
// drop's end is as soft as the pixel, which keeps its area; slopes too fine for a pixel widen the
// lobe by their variance (Toksvig 2005); and drops too fine for it are the mean of all that may lie
// there. A sensor is blown by a drop before its light is spread: so what is spread is the blown
// lobe, not the whole one.
class WetFilm {
 public:
  // Takes the lobes of gloss that are narrow, as one.
  explicit WetFilm(const Lighting& lighting);

  // Of a normal to half-way, for the film to show; above 1: never.
  float least_cosine() const { return least_cosine_; }
  // Adds what whole vectors from pixel `first` on mirror. inverse_pixel: pixels to a mm at depth
  // 1 mm.
  void add(const ScopeSpan& span, float inverse_pixel, unsigned first, int count,
           const SpanColors& colors) const;

  void describe(ScopeShading& shading) const;
  static std::vector<ShaderConstant> constants();

  static constexpr int kHills = 4;
  static constexpr double kWidestFilm = 100;  // exponent: wider lobes are the tissue's sheen
  // The film's lobe is a generalised Trowbridge–Reitz one of γ 4, so many times as wide as its
  // Blinn exponent says: the ring of fibres has an end, and so have its pictures.
  static constexpr float kFilmWidth = 6;
  // Of slopes by the place on a dome (in bumps), by its lean, and what remains as variance of both.
  static constexpr float kDome = 1.5f, kLean = 0.9f, kDropsVariance = 0.42f;
  // Patches lie on the upper hills: those above kUpperHills, and how sharply they end. Between them
  // next to no bump is wet, in their middle all are.
  static constexpr float kUpperHills = 0, kPatches = 0.55f, kDriest = -0.9f, kWetBumps = 2.4f;
  // Of a turn, how far the next longer hills shift the shorter ones' patches, which would lie in
  // rows.
  static constexpr float kAskew = 0.3f;
  // Of the slopes that a pixel covers on a dome, in squares, what widens its lobe.
  static constexpr float kAcross = 1 / 24.f;
  // In squares of bumps: where a large drop ends, and within what; how flat it is one way.
  static constexpr float kDrop = 0.5f, kEdge = 0.15f, kFlat = 5;
  static constexpr float kSoftEnds = 1.75f;   // and within how many pixels at least
  static constexpr float kDropShare = 0.72f;  // of the skin that drops cover if all bumps are wet
  static constexpr float kBlown = 0.97f;      // of full exposure: no mirrored light is brighter
  static constexpr double kBreaks = 0.15;     // slope of the relief on which the film is all drops

  // As plain numbers, so that the loops over pixels see constants.
  struct Wave {
    float x, y, z, phase;  // turns per mm, and at the origin
    float slope_x, slope_y, slope_z;
    float length_mm, variance;  // of the slope along one direction
  };
  struct Bumps {
    float per_mm = 1, slope = 0;
    float drops = 0;  // 0…1: share of the film that is drops
  };

 private:
  void take_lobes(const std::vector<Lighting::Lobe>& gloss, double relief_slope);

  std::array<Wave, kHills> hills_{};
  Bumps bumps_;
  ShineLobe lobe_;
  float least_cosine_ = 2;
};

}  // namespace organbake
