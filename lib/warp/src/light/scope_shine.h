// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "light/skin_light.h"
#include "organbake/bundle/lighting.h"
#include "organbake/warp/organ_source.h"
#include "organbake/warp/view.h"

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
  // Multiplies a group's colours by it, whose skin is that from `first` on; of it nothing is nearer
  // than nearest_mm.
  void multiply(const ScopeSkin& skin, int first, float nearest_mm, float inverse_pixel,
                SkinPlanes& colors) const;

  static constexpr int kOctaves = 3, kGrains = 10;  // in the noise's length
  static constexpr float kOctaveStep = 0.47f;
  static constexpr float kPerGrain = float(kGrainSide) / kGrains,
                         kDeviation = 40;  // of its numbers

 private:
  std::array<float, 3> shares_;  // deviation by channel
  float grain_mm_;               // 0: none
};

// The cosine of a normal to half-way from which on a film shows, above 1: never; and by what share
// more for each more of it. And that from which on it may show on skin beside.
struct FilmReach {
  float least_cosine = 2, inverse_fade = 1, least_near_cosine = 2;
};

// The film of water on serosa, as the light at the scope shows it. On smooth skin it is whole and
// follows the hills: plane waves of some bumps' length. On rougher skin it breaks into drops round
// strewn points (StrewnCell), each leaning a little. A low dome shows the lamp as a disc, the
// larger the less its middle lacks of the mirror direction: drops of all sizes, longer than wide,
// that melt in patches, with few satellites. The disc stays in the drop's middle, where a true one
// would slide by less than its width. Hills tell where drops lie. All of it is bound to the skin
// at rest and turned with it by the least rotation that takes its normal there; so a poke carries
// it, and it does not crawl.
//
// Which drops there are, where and how large, the skin alone tells, never the pixel: what would be
// there at one size of pixels and not at another would flicker while the scope comes near. A pixel
// shows them filtered, so that far is the mean of near: a drop's end is as soft as the pixel, one
// smaller than it is spread over it with all of its light, and drops too fine for it are the mean
// of all that may lie there. On a crease none lie. A whole film's slopes that are too fine for a
// pixel, and those of a crease within it, widen its lobe by their variance (Toksvig 2005). A sensor
// is blown before its light is spread: so what is spread is the blown lobe, not the whole one.
class WetFilm {
 public:
  // Takes the lobes of gloss that are narrow, as one.
  explicit WetFilm(const Lighting& lighting);

  const FilmReach& reach() const { return reach_; }
  // Where skin that is mixed from knots may be lit: lit[i] of each of its places, 1 or 0.
  void find_lit(const ScopeView& view, const ScopeSkin& skin, std::int32_t* lit) const;
  // Adds what skin mirrors to the colours of the pixels at[…] of a span's rows that show it.
  void add(const ScopeView& view, const ScopeSkin& skin, const std::int32_t* at,
           std::span<const SpanColors> rows) const;

  void describe(ScopeShading& shading) const;
  static std::vector<ShaderConstant> constants();

  static constexpr int kHills = 4;
  static constexpr double kWidestFilm = 100;  // exponent: wider lobes are the tissue's sheen
  // The film's lobe is a generalised Trowbridge–Reitz one of γ 4, so many times as wide as its
  // Blinn exponent says: the ring of fibres has an end, and so have its pictures.
  static constexpr float kFilmWidth = 3;
  // Drops in a bump's length, and how much each leans, of the bumps' slope.
  static constexpr double kBumps = 1.5, kLean = 0.96;
  // Patches lie on the upper hills: those above kUpperHills, and how sharply they end. Between them
  // next to no drop is wet, in their middle all are.
  static constexpr float kUpperHills = 0, kPatches = 0.9f, kDriest = -1, kWetBumps = 1.8f;
  // Of a turn, how far the next longer hills shift the shorter ones' patches, which would lie in
  // rows.
  static constexpr float kAskew = 0.3f;
  static constexpr float kCrease = 4;          // by how much a bend of 1 rad a mm dries drops
  static constexpr float kBridges_mm = 0.45f;  // over this, a whole film lies flat on a crease
  // The largest drop's squared radius, in squares of a drop's room, and how far it runs out to both
  // sides, of its radius, nearly always within what is asked of points. Where the lobe has fallen
  // to kEnd no drop is lit; toward the mirror direction it grows to its own size, kGrows before
  // that is reached.
  static constexpr float kDrop = 0.16f, kRun = 0.5f, kEnd = 0.001f, kGrows = 1.5f;
  static constexpr float kJitter = 0.6f;    // of a room's side, how far the points are strewn
  static constexpr float kEdge = 0.06f;     // within this it ends,
  static constexpr float kSoftEnds = 1.5f;  // and within so many pixels at least
  static constexpr float kBlown = 0.97f;    // of full exposure: no mirrored light is brighter
  static constexpr double kBreaks = 0.06;   // slope of the relief from which on the film is drops
  // A whole film fades out over this share of what 1 − cosine it may show up to.
  static constexpr float kFade = 0.3f, kNoFade = 1e6f;
  static constexpr double kBesideKnots = 0.05;  // rad: more than skin turns from one to the next

  // As plain numbers, so that the loops over pixels see constants.
  struct Wave {
    float x, y, z, phase;  // turns per mm, and at the origin
    float slope_x, slope_y, slope_z;
    float length_mm, variance;  // of the slope along one direction
  };
  struct Drops {
    float per_mm = 1, lean = 0;
    float inverse_lit2 = 0;  // of the squared slope that lacks where none is lit; 0: a whole film
    float lean2 = 0;         // squared lean, in those
    float none = 0, whole = 1;  // shares, for most_of() and least_of()
  };

 private:
  void take_lobes(const std::vector<Lighting::Lobe>& gloss, double relief_slope,
                  double steepest_hills);

  std::array<Wave, kHills> hills_{};
  Drops drops_;
  ShineLobe lobe_;
  FilmReach reach_;
};

// Lights skin by a ScopeLight with a SkinFinish:
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

  const ScopeView& view() const { return view_; }
  const WetFilm& film() const { return film_; }
  const SkinGrain& grain() const { return grain_; }

  // What the light makes of skin, but for grain and film; its place at rest is not asked for.
  void light(const ScopeSkin& skin, ScopeLit& lit) const;

  static constexpr std::array<float, 3> kSheen = {0.85f, 0.95f, 1.2f};  // RGB

 private:
  ScopeLight scope_;
  SkinFinish finish_;
  WetFilm film_;
  SkinGrain grain_;
  std::array<ShineLobe, 2> sheen_{};
  ScopeView view_;
};

}  // namespace organbake
