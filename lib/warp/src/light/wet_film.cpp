// SPDX-License-Identifier: Apache-2.0
// The film of water on serosa by the pixel: how its drops lie, and what they mirror.
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "light/scope_shine.h"

namespace organbake {
namespace {

// One of the points strewn in space, one in each cube of a lattice (Worley 1996), near a place.
struct StrewnCell {
  float x, y, z;  // of the place, from the point
  std::uint32_t hash;

  float distance2() const { return x * x + y * y + z * z; }
  // One of four numbers of −most…most about a middle that belong to the point.
  float chance(int which, float most, float middle = 0) const {
    const std::uint32_t bits = (hash * 0x9e3779b1u) >> (8 * which) & 255u;
    return static_cast<float>(static_cast<std::int32_t>(bits)) * (most / 127.5f) + (middle - most);
  }
};

// visit(StrewnCell) for the points of the eight cubes about a place, x, y, z in cubes. Points keep
// from their cubes' walls: of the others none is nearer than kStrewnReach. Hashes of whole numbers,
// the same everywhere; written out so that loops over pixels vectorise.
constexpr float kJitter = WetFilm::kJitter, kStrewnReach = 1 - 0.5f * kJitter;

template <class Visit>
inline __attribute__((always_inline)) void visit_cells(float x, float y, float z,
                                                       const Visit& visit) {
  constexpr float kStep = kJitter / 1023, kFirst = 0.5f - 0.5f * kJitter;
  constexpr std::uint32_t kX = 0x8da6b343u, kY = 0xd8163841u, kZ = 0xcb1ab31fu;
  const float x0 = std::floor(x - 0.5f), y0 = std::floor(y - 0.5f), z0 = std::floor(z - 0.5f);
  const std::uint32_t at = static_cast<std::uint32_t>(static_cast<std::int32_t>(x0)) * kX +
                           static_cast<std::uint32_t>(static_cast<std::int32_t>(y0)) * kY +
                           static_cast<std::uint32_t>(static_cast<std::int32_t>(z0)) * kZ;
  const float in_x = x - x0 - kFirst, in_y = y - y0 - kFirst, in_z = z - z0 - kFirst;
  const auto ask = [&](std::uint32_t i, std::uint32_t j, std::uint32_t k)
      __attribute__((always_inline)) {
    std::uint32_t h = at + i * kX + j * kY + k * kZ;
    h = (h ^ (h >> 15)) * 0x85ebca6bu;
    h ^= h >> 13;
    const auto part = [&](int shift) {
      return kStep * static_cast<float>(static_cast<std::int32_t>((h >> shift) & 1023u));
    };
    visit(StrewnCell{in_x - static_cast<float>(i) - part(0),
                     in_y - static_cast<float>(j) - part(10),
                     in_z - static_cast<float>(k) - part(20), h});
  };
  ask(0, 0, 0), ask(1, 0, 0), ask(0, 1, 0), ask(1, 1, 0);
  ask(0, 0, 1), ask(1, 0, 1), ask(0, 1, 1), ask(1, 1, 1);
}

using Wave = WetFilm::Wave;

// The sine of whole turns, as parabolas: continuous with its slope, which is all a relief needs.
inline float wave_at(float turns) {
  const float t = turns - std::nearbyint(turns);
  return 8 * t * (1 - 2 * std::abs(t));
}
inline float slope_of_wave_at(float turns) {
  return 8 * (1 - 4 * std::abs(turns - std::nearbyint(turns)));
}

// Where each of the hills' waves goes, and its phase: to the corners of a tetrahedron, turned off
// the axes. Waves that go nearly one way lay their patches in stripes.
constexpr double kCourses[WetFilm::kHills][4] = {{0.4326, 0.7372, 0.519, 0.1287},
                                                 {0.5348, -0.1856, -0.8243, 0.7574},
                                                 {-0.9265, 0.2734, -0.2583, 0.3861},
                                                 {-0.0409, -0.825, 0.5636, 0.0148}};

Wave make_wave(int number, double length_mm, double slope) {
  const auto& [x, y, z, phase] = kCourses[number];
  const auto part = [](double value) { return static_cast<float>(value); };
  return {part(x / length_mm), part(y / length_mm), part(z / length_mm), part(phase),
          part(slope * x), part(slope * y), part(slope * z), part(length_mm),
          // Mean over a turn 8 / 15, and over directions in space a third of it along one.
          part(slope * slope * 8 / 45)};
}

}  // namespace

WetFilm::WetFilm(const Lighting& lighting) {
  // Bumps of about one size, on hills of a few times that, longer where no drops lie on them.
  constexpr double kHillShare = 0.6;  // of the slopes' variance
  const SkinFinish& finish = lighting.finish;
  const bool breaks = finish.relief_slope > kBreaks;
  const double smallest = breaks ? 5 : 6.5, largest = breaks ? 16 : 20;
  const double hill = finish.relief_slope * std::sqrt(kHillShare / kHills * 45 / 16);
  for (int k = 0; k < int(kHills); ++k) {
    const double size = smallest * std::pow(largest / smallest, double(k) / (kHills - 1));
    hills_[k] = make_wave(k, finish.relief_mm * size, hill);
  }
  drops_.per_mm = static_cast<float>(kBumps / finish.relief_mm);
  drops_.lean = static_cast<float>(kLean * finish.relief_slope * std::sqrt(1 - kHillShare));
  // To a tetrahedron's corners, waves of height 1 add up to no more than 4 / √3 of one.
  take_lobes(lighting.gloss, finish.relief_slope, 4 / std::sqrt(3) * hill);
}

// As bright as all narrow lobes together, and as wide as they are on average. It shows up to two
// deviations of the relief from half-way and to where it hardly shows, and fades out before that;
// drops end by themselves, as far as the steepest hills and the one that leans most reach. How far
// a drop is lit does not depend on how much light there is: it would grow while the scope comes
// near.
void WetFilm::take_lobes(const std::vector<Lighting::Lobe>& gloss, double relief_slope,
                         double steepest_hills) {
  constexpr double kHardlyShows = 0.01;
  double strength = 0, energy = 0;
  for (const Lighting::Lobe& lobe : gloss) {
    if (lobe.exponent < kWidestFilm) continue;
    strength += lobe.strength;
    energy += lobe.strength * kFilmWidth * 2 / (lobe.exponent + 2);
  }
  if (!(strength > 0)) return;
  const double alpha2 = energy / strength;
  lobe_ = {static_cast<float>(strength), static_cast<float>(alpha2)};
  const double times = std::sqrt(std::max(1.0, strength / kHardlyShows)) - 1;
  const double whole = 2.2 * relief_slope + std::sqrt(std::min(times, 4.0) * alpha2);
  const double lit2 = (std::sqrt(std::sqrt(std::max(1.0, strength) / kEnd)) - 1) * alpha2;
  const bool breaks = relief_slope > kBreaks;
  if (breaks) drops_.inverse_lit2 = static_cast<float>(1 / lit2);
  drops_.lean2 = drops_.lean * drops_.lean * drops_.inverse_lit2;
  const double farthest = std::sqrt(lit2) + std::sqrt(3) * drops_.lean;
  const double reach = std::min(1.4, breaks ? std::atan(farthest + steepest_hills) : whole);
  reach_.least_cosine = static_cast<float>(std::cos(reach));
  reach_.least_near_cosine = static_cast<float>(std::cos(reach + kBesideKnots));
  reach_.inverse_fade = breaks ? kNoFade : 1 / (kFade * (1 - reach_.least_cosine));
}

namespace {

struct Slopes {
  float x, y, z;  // at rest, not yet along the skin
};
struct Hills {
  Slopes slopes;
  float lost;    // variance of the slopes of what a pixel cannot show
  float wet;     // −kHills…kHills
  Slopes rises;  // of wet, a mm
};

// Written out wave by wave, the longest first: a loop in the loop over pixels would keep that from
// being vectorised. The shortest is too steep for patches: they would end within a drop.
static_assert(WetFilm::kHills == 4);
inline __attribute__((always_inline)) Hills hills_at(const Wave* hills, const float* p,
                                                     float pixels_per_mm) {
  Hills sum = {};
  const auto add = [&](const Wave& w, bool of_patches) {
    const float turns = w.x * p[0] + w.y * p[1] + w.z * p[2] + w.phase;
    const float share = resolved(w.length_mm * pixels_per_mm), height = share * wave_at(turns);
    const float shifted = turns + 0.25f + WetFilm::kAskew * sum.wet;
    const float rises = of_patches ? slope_of_wave_at(shifted) : 0;
    sum.wet += of_patches ? wave_at(shifted) : 0;
    sum.rises.x += rises * (w.x + WetFilm::kAskew * sum.rises.x);
    sum.rises.y += rises * (w.y + WetFilm::kAskew * sum.rises.y);
    sum.rises.z += rises * (w.z + WetFilm::kAskew * sum.rises.z);
    sum.slopes.x += height * w.slope_x;
    sum.slopes.y += height * w.slope_y;
    sum.slopes.z += height * w.slope_z;
    sum.lost += (1 - share * share) * w.variance;
  };
  add(hills[3], true), add(hills[2], true), add(hills[1], true), add(hills[0], false);
  return sum;
}

// By how much the half-way direction leans from the normal at rest, as slopes along the skin: what
// the film's own slopes have to make up for to mirror the lamp.
struct Lacking {
  float x, y, z, squared;
};

// Half-way turned back by the least rotation from normal n to normal m, over its part along m.
inline __attribute__((always_inline)) Lacking lacking_at(const float* n, const float* m,
                                                         const float* h, const Slopes& g) {
  constexpr float kOpposite = 1e-4f, kLeastAlong = 0.1f;
  const float between = m[0] * n[0] + m[1] * n[1] + m[2] * n[2];
  const float on_n = n[0] * h[0] + n[1] * h[1] + n[2] * h[2];
  const float on_m = m[0] * h[0] + m[1] * h[1] + m[2] * h[2];
  const float both = (on_n + on_m) / (1 + kOpposite + between);
  // Turned back, it has of m what it had of n.
  const float inverse = 1 / (on_n > kLeastAlong ? on_n : kLeastAlong);
  const float out = m[0] * g.x + m[1] * g.y + m[2] * g.z;
  const float of_m = inverse * (2 * on_n - both) - 1 - out;
  Lacking e{inverse * (h[0] - both * n[0]) + of_m * m[0] + g.x,
            inverse * (h[1] - both * n[1]) + of_m * m[1] + g.y,
            inverse * (h[2] - both * n[2]) + of_m * m[2] + g.z, 0};
  e.squared = e.x * e.x + e.y * e.y + e.z * e.z;
  return e;
}

// A whole film's lobe in light that is `share` of full exposure, widened by slopes of the variance
// `lost` along one direction: those of a lobe of α² have α² / 4. What is blown is cut off before it
// is widened: a disc of kBlown with the rest of the lobe round it has the light of a lobe of that
// height and α² (4 k − 3), k⁴ what it was too bright by.
inline __attribute__((always_inline)) float light_of_film(const ShineLobe& lobe, float share,
                                                          float lost, float lacks2) {
  const float full = share * lobe.strength * (1 / WetFilm::kBlown);
  const float k2 = std::sqrt(full > 1 ? full : 1), k = std::sqrt(k2);
  const float cut = at_most_1(4 * lost / lobe.alpha2);
  const float alpha2 = lobe.alpha2 * (1 + cut * 4 * (k - 1));
  const float wide = alpha2 + 4 * lost;
  const float over_blown = (full + cut * (full / (k2 * k2) - full)) * alpha2 / wide;
  const float ratio = wide / (wide + lacks2), squared = ratio * ratio;
  return at_most_1(over_blown * squared * squared);
}

// Of two variables: of the one with a constant gcc makes two instructions.
inline float least_of(float a, float b) { return a < b ? a : b; }
inline float most_of(float a, float b) { return a > b ? a : b; }

// How far up the hills a place lies: none is wet at 0 and below, all at 1. A bump there is wet by
// as much as it rises from the driest and its own chance of −1…1 are more than nothing, wholly from
// 1 on.
inline float height_on_hills(float hills) {
  return 0.5f + WetFilm::kPatches * (hills - WetFilm::kUpperHills);
}
inline float driest(float bend) { return WetFilm::kDriest - WetFilm::kCrease * bend; }
inline float wetter_by(const WetFilm::Drops& drops, float height) {
  const float t = least_of(most_of(height, drops.none), drops.whole);
  return WetFilm::kWetBumps * (t * t * (3 - 2 * t));
}

// Of the drops about a place: what they mirror, each by the share of the pixel that it covers. One
// that is smaller than a pixel is drawn as large as that, and fainter by as much. Each runs out to
// both sides along its lean, so that many melt into one. It shrinks slowly with its point's height:
// cut out of a ball, it would be there or not by a hundredth of a millimetre. How wet and how lit
// it is its point tells, to first order: the hills rise by so much a room, and half-way turns back.
// By what a pixel beside it has, one too small to be seen would shine in pixels and not in parts of
// them.
inline __attribute__((always_inline)) float light_of_drops(const WetFilm::Drops& drops,
                                                           const float* m, const float* p,
                                                           const Lacking& lacks, float height,
                                                           const Slopes& rises, float dry,
                                                           float turns, float pixel) {
  const float none = drops.none, whole = drops.whole;
  const auto within = [&](float v) { return least_of(most_of(v, none), whole); };
  constexpr float kInverseReach2 = 1 / (kStrewnReach * kStrewnReach);
  const float by_pixel = WetFilm::kSoftEnds * pixel;
  const float soft = by_pixel > WetFilm::kEdge ? by_pixel : WetFilm::kEdge;
  const float run = WetFilm::kRun / drops.lean;
  float light = 0;
  visit_cells(
      drops.per_mm * p[0], drops.per_mm * p[1],
      drops.per_mm * p[2], [&](const StrewnCell& cell) __attribute__((always_inline)) {
        const float above = rises.x * cell.x + rises.y * cell.y + rises.z * cell.z;
        const float own = within(wetter_by(drops, height - above) + cell.chance(3, 1, dry));
        const float out = cell.x * m[0] + cell.y * m[1] + cell.z * m[2], out2 = out * out;
        const float cx = cell.chance(0, drops.lean), cy = cell.chance(1, drops.lean),
                    cz = cell.chance(2, drops.lean);
        const float on_m = cx * m[0] + cy * m[1] + cz * m[2];
        const float ex = lacks.x + cx + turns * cell.x, ey = lacks.y + cy + turns * cell.y,
                    ez = lacks.z + cz + turns * cell.z, e_on_m = on_m + turns * out;
        const float lit = 1 - drops.inverse_lit2 * (ex * ex + ey * ey + ez * ez - e_on_m * e_on_m);
        const float size2 = WetFilm::kDrop * own * within(WetFilm::kGrows * lit) *
                            most_of(1 - kInverseReach2 * out2, none);
        const float size = std::sqrt(size2), least = 0.5f * soft;
        const float drawn = most_of(size, least), inverse = 1 / (2 * drawn * soft);
        // Of the piece that it runs out along, as far from its middle in units of the lean.
        const float along = cell.x * cx + cell.y * cy + cell.z * cz - on_m * out;
        const float lean2 = cx * cx + cy * cy + cz * cz - on_m * on_m;
        const float farthest = run * drawn, there = along / (lean2 + 1e-9f);
        const float at = most_of(least_of(there, farthest), -farthest);
        const float away2 = cell.distance2() - out2 + at * (at * lean2 - 2 * along);
        const float in = within(0.5f + (drawn * drawn - away2) * inverse);
        const float kept = size2 / (drawn * drawn);
        // Where soft ends of two meet, one covers of the other what chance would have it.
        light += (1 - light) * kept * in * in * (3 - 2 * in);
      });
  return light;
}

// The mean of that over all drops that may lie there, within a tenth.
inline float mean_of_drops(const WetFilm::Drops& drops, float lacks2, float wet) {
  const float t = at_most_1(0.5f * positive(wet + 1)), beyond = positive(t - 0.5f);
  const float own = t * t - beyond * beyond, wide = 1.05f + 1.8f * drops.lean2;
  const float lit = positive(1 - lacks2 * drops.inverse_lit2 / wide) / wide;
  return own * (0.72f - 0.11f * own) * at_most_1(WetFilm::kGrows * lit);
}

// What a pixel's film is asked for by.
struct FilmPoint {
  float rest[3], place[3];
  Hills hill = {};
  Lacking lacks = {};
  float share = 0, shows = 0;  // of full exposure; of the film, 0…1
  float pixels_per_mm = 1;
};

[[gnu::always_inline]] inline FilmPoint film_point(const ScopeView& view, const ScopeSkin& skin,
                                                   const Wave* hills, const FilmReach& reach,
                                                   unsigned i) {
  const float depth = skin.depth_mm[i];
  const ScopeRay ray = scope_ray(view, skin.column[i], skin.row[i], depth);
  const auto& [nx, ny, nz, more_bent] = skin.normals.of;
  const auto& [mx, my, mz, bend] = skin.rest_normals.of;
  const auto& [lx, ly, lz] = ray.light;
  const auto& [ex, ey, ez] = ray.eye;
  const auto& [hx, hy, hz] = ray.half_way;
  const float unit = 1 / std::sqrt(mx[i] * mx[i] + my[i] * my[i] + mz[i] * mz[i] + 1e-20f);
  FilmPoint at = {{unit * mx[i], unit * my[i], unit * mz[i]},
                  {skin.rest_mm.of[0][i], skin.rest_mm.of[1][i], skin.rest_mm.of[2][i]}};
  const float of_normal = 1 / std::sqrt(nx[i] * nx[i] + ny[i] * ny[i] + nz[i] * nz[i] + 1e-20f);
  const float normal[3] = {of_normal * nx[i], of_normal * ny[i], of_normal * nz[i]};
  const float near = normal[0] * hx + normal[1] * hy + normal[2] * hz;
  const float facing = normal[0] * lx + normal[1] * ly + normal[2] * lz;
  const float seen = normal[0] * ex + normal[1] * ey + normal[2] * ez;
  at.share = ray.share;
  // On the side that is seen.
  at.shows = at_most_1(positive((near - reach.least_cosine) * reach.inverse_fade)) *
             at_most_1(8 * positive(facing)) * (seen < 0 ? 0.f : 1.f);
  at.pixels_per_mm = view.inverse_pixel / depth;
  at.hill = hills_at(hills, at.place, at.pixels_per_mm);
  at.lacks = lacking_at(normal, at.rest, ray.half_way, at.hill.slopes);
  return at;
}

// The share of a pixel that drops which mirror the lamp cover.
inline __attribute__((always_inline)) float covered_by_drops(const WetFilm::Drops& drops,
                                                             const FilmPoint& at, float depth_mm,
                                                             float bend) {
  const float height = height_on_hills(at.hill.wet), room_mm = 1 / drops.per_mm;
  const Slopes& g = at.hill.rises;  // along the skin
  const float on_m = g.x * at.rest[0] + g.y * at.rest[1] + g.z * at.rest[2];
  const float rises = WetFilm::kPatches * room_mm;
  const Slopes along = {rises * (g.x - on_m * at.rest[0]), rises * (g.y - on_m * at.rest[1]),
                        rises * (g.z - on_m * at.rest[2])};
  const float turns = (1 / depth_mm + bend) * room_mm, pixel = drops.per_mm / at.pixels_per_mm;
  const float dry = driest(bend), wet = dry + wetter_by(drops, height);
  const float each =
      light_of_drops(drops, at.rest, at.place, at.lacks, height, along, dry, turns, pixel);
  // Hills too fine for the pixel lean its drops in both directions. A drop as soft as larger pixels
  // would reach beyond the cubes that are asked.
  const float mean = mean_of_drops(drops, at.lacks.squared + 2 * at.hill.lost, wet);
  return mean + at_most_1(positive(2 - pixel * (1 / kStrewnReach))) * (each - mean);
}

// A point some rooms away reaches here if it is wet and lit enough for so large a drop: the
// largest, run out along a room's diagonal, ends kReaches away, and one that ends beyond kNear is
// wet by kFarWet. A place's own numbers may differ from the skin's by as much as knots may be off.
ORGANBAKE_MULTIVERSION void find_lit_drops(const ScopeView view, const ScopeSkin& skin,
                                           const WetFilm::Drops drops, const Wave* hills,
                                           const FilmReach reach, std::int32_t* __restrict lit) {
  constexpr float kOff = 0.02f, kReaches = 0.75f, kNear = 0.45f;
  constexpr float kFarWet = kNear * kNear / (kReaches * kReaches);
  const float lit_to = 1 / std::sqrt(drops.inverse_lit2), room_mm = 1 / drops.per_mm;
  // Half-way turns on the way to it; the less it is lit, the less far it reaches.
  const float by_turns2 = 0.5f * WetFilm::kGrows * kReaches * kReaches / lit_to;
  ORGANBAKE_INDEPENDENT
  for (unsigned i = 0; i < whole_vectors(skin.count); ++i) {
    const FilmPoint at = film_point(view, skin, hills, reach, i);
    const float bend = skin.rest_normals.of[3][i];
    const Slopes& g = at.hill.rises;
    const float rises = WetFilm::kPatches * room_mm * std::sqrt(g.x * g.x + g.y * g.y + g.z * g.z);
    const float height = height_on_hills(at.hill.wet + kOff);
    const float wet = most_of(wetter_by(drops, height + kNear * rises),
                              wetter_by(drops, height + kReaches * rises) - kFarWet);
    const float turns = (1 / skin.depth_mm[i] + bend) * room_mm;
    const float leans = std::abs(at.lacks.x) + std::abs(at.lacks.y) + std::abs(at.lacks.z);
    const float lit_within = lit_to + by_turns2 * turns * turns + kOff;
    lit[i] = (at.lacks.squared <= lit_within * std::sqrt(at.lacks.squared) + drops.lean * leans) &
             (wet > -1 - kOff - driest(bend));
  }
}

// The share of full exposure that skin mirrors, of drops with that of the pixel that they cover.
ORGANBAKE_MULTIVERSION void film_pixels(const ScopeView view, const ScopeSkin& skin,
                                        const WetFilm::Drops drops, const Wave* hills,
                                        const ShineLobe film, const FilmReach reach,
                                        float* __restrict mirrored) {
  if (drops.inverse_lit2 > 0) {
    ORGANBAKE_INDEPENDENT
    for (unsigned i = 0; i < whole_vectors(skin.count); ++i) {
      const FilmPoint at = film_point(view, skin, hills, reach, i);
      mirrored[i] = at.shows * WetFilm::kBlown * at_most_1(at.share * film.strength) *
                    covered_by_drops(drops, at, skin.depth_mm[i], skin.rest_normals.of[3][i]);
    }
    return;
  }
  ORGANBAKE_INDEPENDENT
  for (unsigned i = 0; i < whole_vectors(skin.count); ++i) {
    const FilmPoint at = film_point(view, skin, hills, reach, i);
    // Water bridges a crease, and a pixel shows no less than its own size of it.
    const float bent = skin.rest_normals.of[3][i] * (1 / at.pixels_per_mm + WetFilm::kBridges_mm);
    mirrored[i] = at.shows * WetFilm::kBlown *
                  light_of_film(film, at.share, at.hill.lost + bent * bent, at.lacks.squared);
  }
}

}  // namespace

void WetFilm::find_lit(const ScopeView& view, const ScopeSkin& skin, std::int32_t* lit) const {
  if (drops_.inverse_lit2 > 0)
    return find_lit_drops(view, skin, drops_, hills_.data(), reach_, lit);
  std::fill_n(lit, skin.count, 1);
}

void WetFilm::add(const ScopeView& view, const ScopeSkin& skin, const std::int32_t* at,
                  std::span<const SpanColors> rows) const {
  alignas(64) float mirrored[kMostSkin];
  film_pixels(view, skin, drops_, hills_.data(), lobe_, reach_, mirrored);
  // The skin that a pixel shows beside a drop is all that adds to its light: a drop alone is blown.
  const float covers = drops_.inverse_lit2 > 0 ? 1 : 0;
  for (int k = 0; k < skin.count; ++k) {
    if (!(mirrored[k] > 0)) continue;
    const SpanColors& row = rows[at[k] / kSpan];
    const int i = at[k] % kSpan;
    for (float* const plane : row.planes)
      plane[i] += mirrored[k] * positive(row.white[i] - covers * plane[i]);
  }
}

}  // namespace organbake
