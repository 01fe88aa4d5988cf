// SPDX-License-Identifier: Apache-2.0
// The film of water on serosa by the pixel: how its drops lie, and what they mirror.
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>

#include "light/scope_shine.h"
#include "picture/spans.h"

namespace organbake {
namespace {

// One of the points strewn in space, one in each cube of a lattice (Worley 1996), near a place.
struct StrewnCell {
  float x, y, z;  // of the place, from the point
  std::uint32_t hash;

  float distance2() const { return x * x + y * y + z * z; }
  // One of four numbers of −1…1 that belong to the point.
  float chance(int which) const {
    const std::uint32_t bits = (hash * 0x9e3779b1u) >> (8 * which) & 255u;
    return static_cast<float>(static_cast<std::int32_t>(bits)) * (1 / 127.5f) - 1;
  }
};

// visit(StrewnCell) for the points of the eight cubes about a place, x, y, z in cubes. Points keep
// from their cubes' walls: of the others none is nearer than kStrewnReach. Hashes of whole numbers,
// the same everywhere; written out so that loops over pixels vectorise.
inline constexpr float kJitter = 0.7f, kStrewnReach = 1 - 0.5f * kJitter;

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

// The sine of whole turns, as parabolas: continuous with its slope, which is
// all a relief needs.
inline float wave_at(float turns) {
  const float t = turns - std::nearbyint(turns);
  return 8 * t * (1 - 2 * std::abs(t));
}

// A sequence that fills the unit cube evenly (Roberts 2018): waves that are
// random, but never alike, and the same everywhere.
double evenly(int i, int dimension) {
  constexpr std::array<double, 4> kSteps = {0.8566748838545029, 0.7338918566271260,
                                            0.6287067210378087, 0.5385972572236101};
  const double at = 0.5 + (i + 1) * kSteps[dimension];
  return at - std::floor(at);
}

Wave make_wave(int number, double length_mm, double slope) {
  const double z = 2 * evenly(number, 0) - 1, turn = 2 * std::numbers::pi * evenly(number, 1);
  const double flat = std::sqrt(std::max(0.0, 1 - z * z));
  const Eigen::Vector3d toward(flat * std::cos(turn), flat * std::sin(turn), z);
  Wave wave;
  wave.x = static_cast<float>(toward.x() / length_mm);
  wave.y = static_cast<float>(toward.y() / length_mm);
  wave.z = static_cast<float>(toward.z() / length_mm);
  wave.phase = static_cast<float>(evenly(number, 2));
  wave.slope_x = static_cast<float>(slope * toward.x());
  wave.slope_y = static_cast<float>(slope * toward.y());
  wave.slope_z = static_cast<float>(slope * toward.z());
  wave.length_mm = static_cast<float>(length_mm);
  // Mean over a turn 8 / 15, and over directions in space a third of it along
  // one.
  wave.variance = static_cast<float>(slope * slope * 8 / 45);
  return wave;
}

}  // namespace

WetFilm::WetFilm(const Lighting& lighting) {
  // Bumps of about one size, on hills of a few to twenty times that.
  constexpr double kSmallestHill = 5, kLargestHill = 19;
  constexpr double kHillShare = 0.3;  // of the slopes' variance
  const SkinFinish& finish = lighting.finish;
  const double hill = finish.relief_slope * std::sqrt(kHillShare / kHills * 45 / 16);
  for (int k = 0; k < int(kHills); ++k) {
    const double size =
        kSmallestHill * std::pow(kLargestHill / kSmallestHill, double(k) / (kHills - 1));
    hills_[k] = make_wave(k, finish.relief_mm * size, hill);
  }
  bumps_.per_mm = static_cast<float>(1 / finish.relief_mm);
  bumps_.slope = static_cast<float>(finish.relief_slope * std::sqrt(1 - kHillShare));
  bumps_.drops = static_cast<float>(std::min(1.0, finish.relief_slope / kBreaks));
  take_lobes(lighting.gloss, finish.relief_slope);
}

// As bright as all narrow lobes together, and as wide as they are on average. It shows up to two
// deviations and a bit of the relief from half-way, and to where it hardly shows.
void WetFilm::take_lobes(const std::vector<Lighting::Lobe>& gloss, double relief_slope) {
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
  const double reach = std::min(1.4, 2.2 * relief_slope + std::sqrt(std::min(times, 4.0) * alpha2));
  least_cosine_ = static_cast<float>(std::cos(reach));
}

namespace {

struct Slopes {
  float x, y, z;  // at rest, not yet along the skin
};
struct Hills {
  Slopes slopes;
  float lost;  // variance of the slopes of what a pixel cannot show
  float wet;   // −kHills…kHills
};

// Written out wave by wave, the longest first: a loop in the loop over pixels would keep that from
// being vectorised. The shortest is too steep for patches: they would end within a drop.
template <std::size_t... k>
inline __attribute__((always_inline)) Hills hills_at(const Wave* hills, const float* p,
                                                     float pixels_per_mm,
                                                     std::index_sequence<k...>) {
  Hills sum = {{0, 0, 0}, 0, 0};
  const auto add = [&](const Wave& w, bool of_patches) {
    const float turns = w.x * p[0] + w.y * p[1] + w.z * p[2] + w.phase;
    const float share = resolved(w.length_mm * pixels_per_mm), height = share * wave_at(turns);
    const float patch = wave_at(turns + 0.25f + WetFilm::kAskew * sum.wet);
    sum.wet += of_patches ? patch : 0;
    sum.slopes.x += height * w.slope_x;
    sum.slopes.y += height * w.slope_y;
    sum.slopes.z += height * w.slope_z;
    sum.lost += (1 - share * share) * w.variance;
  };
  (add(hills[sizeof...(k) - 1 - k], k + 1 < sizeof...(k)), ...);
  return sum;
}

// A fraction that is not divided out: what is done with it divides once more, and a processor takes
// as long for that as for ten products.
struct Fraction {
  float over, under;
};

// Half-way between light and eye as the skin at rest has it, and the normal m there.
struct Mirror {
  float mx, my, mz, hx, hy, hz, along;  // along: m · h

  // The squared cosine of the normal that leans by slopes.
  Fraction cosine2(const Slopes& g) const {
    const float out = g.x * mx + g.y * my + g.z * mz;
    const float toward = positive(along - (g.x * hx + g.y * hy + g.z * hz) + out * along);
    return {toward * toward, 1 + g.x * g.x + g.y * g.y + g.z * g.z - out * out + 1e-20f};
  }
};

// Half-way turned back by the least rotation from normal to normal.
inline __attribute__((always_inline)) Mirror mirror_at(const float* n, const float* m,
                                                       const float* h) {
  constexpr float kOpposite = 1e-4f;
  const float between = m[0] * n[0] + m[1] * n[1] + m[2] * n[2];
  const float on_n = n[0] * h[0] + n[1] * h[1] + n[2] * h[2];
  const float on_m = m[0] * h[0] + m[1] * h[1] + m[2] * h[2];
  const float both = (on_n + on_m) / (1 + kOpposite + between);
  const float back = 2 * on_n - both;
  Mirror mirror{m[0], m[1], m[2], 0, 0, 0, 0};
  mirror.hx = h[0] - both * n[0] + back * m[0];
  mirror.hy = h[1] - both * n[1] + back * m[1];
  mirror.hz = h[2] - both * n[2] + back * m[2];
  mirror.along = mirror.hx * m[0] + mirror.hy * m[1] + mirror.hz * m[2];
  return mirror;
}

// A lobe in light that is `share` of full exposure, widened by slopes of the variance `lost` along
// one direction: those of a lobe of α² have α² / 4. What is blown is cut off before it is widened:
// a disc of kBlown with the rest of the lobe round it has the light of a lobe of that height and
// α² (4 k − 3), k⁴ what it was too bright by.
struct LitLobe {
  float bright, wide;

  LitLobe(const ShineLobe& lobe, float share, float lost) {
    const float full = share * lobe.strength, over = full * (1 / WetFilm::kBlown);
    const float k2 = std::sqrt(over > 1 ? over : 1), k = std::sqrt(k2);
    const float cut = at_most_1(4 * lost / lobe.alpha2);
    const float peak = full + cut * (full / (k2 * k2) - full);
    const float alpha2 = lobe.alpha2 * (1 + cut * 4 * (k - 1));
    wide = alpha2 + 4 * lost;
    bright = peak * alpha2 / wide;
  }
  float at(const Fraction& cosine2) const {
    const auto [over, under] = cosine2;
    const float ratio = wide * under / (under - over * (1 - wide) + 1e-12f);
    const float squared = ratio * ratio;
    const float light = bright * squared * squared;
    return light < WetFilm::kBlown ? light : WetFilm::kBlown;
  }
};

// Of the drops about a place: what they mirror, each by the share of the pixel that it covers.
inline __attribute__((always_inline)) float light_of_drops(const WetFilm::Bumps& bumps,
                                                           const float* p, const Hills& hills,
                                                           float wet, float height, float pixel,
                                                           const Mirror& mirror,
                                                           const LitLobe& lobe) {
  const float dome = -WetFilm::kDome * height, lean = WetFilm::kLean * height;
  constexpr float kEdge2 = WetFilm::kEdge * WetFilm::kEdge, kFlat = WetFilm::kFlat;
  const float soft2 = WetFilm::kSoftEnds * WetFilm::kSoftEnds * pixel * pixel;
  float light = 0;
  visit_cells(
      bumps.per_mm * p[0], bumps.per_mm * p[1],
      bumps.per_mm * p[2], [&](const StrewnCell& cell) __attribute__((always_inline)) {
        const float own = at_most_1(positive(wet + cell.chance(3)));
        const float cx = cell.chance(0), cy = cell.chance(1), cz = cell.chance(2);
        // Drops are flatter one way along the skin, which is a chance as their lean is.
        const float out = cell.x * mirror.mx + cell.y * mirror.my + cell.z * mirror.mz;
        const float on_m = cx * mirror.mx + cy * mirror.my + cz * mirror.mz;
        const float flat = cell.x * cx + cell.y * cy + cell.z * cz - out * on_m,
                    flat2 = flat * flat;
        const float from2 = cell.distance2() + kFlat * flat2;
        // How steeply that rises along the skin at the drop's end on this side of it.
        const float along2 = cx * cx + cy * cy + cz * cz - on_m * on_m;
        const float steep2 =
            4 * (cell.distance2() - out * out + kFlat * flat2 * (2 + kFlat * along2));
        const float ends_at = WetFilm::kDrop * own;
        const float apart2 = from2 + 1e-6f;
        const float end = std::sqrt(apart2 / (kEdge2 * apart2 + soft2 * ends_at * steep2));
        // Where the end is softer than the drop is large, it would gain light.
        const float size = end * ends_at, size2 = size * size;
        const float in = at_most_1(positive(0.5f + size - end * from2));
        const float kept = size2 / (size2 + 1 / 36.f);
        const Slopes slopes = {hills.slopes.x + dome * cell.x + lean * cx,
                               hills.slopes.y + dome * cell.y + lean * cy,
                               hills.slopes.z + dome * cell.z + lean * cz};
        light += kept * in * in * (3 - 2 * in) * lobe.at(mirror.cosine2(slopes));
      });
  return light;
}

// A bump is wet by as much as this and its own chance of −1…1 are more than nothing, and wholly
// from 1 on.
inline float wetness(float hills) {
  const float patch =
      at_most_1(positive(0.5f + WetFilm::kPatches * (hills - WetFilm::kUpperHills)));
  return WetFilm::kDriest + WetFilm::kWetBumps * patch;
}
// The mean of all bumps, within a hundredth.
inline float wet_bumps(float wetness) {
  const float t = at_most_1(positive((1 + wetness) * (1 / 3.f)));
  return t * t * (3 - 2 * t);
}

struct FilmPlanes {
  const float *share, *shows, *white, *depth;
  SkinVectors normal, half_way, rest_normal, rest_mm;
};

// Some whole vectors from pixel `first` on.
ORGANBAKE_MULTIVERSION void film_pixels(const FilmPlanes& in, const WetFilm::Bumps& bumps,
                                        const Wave* hills, const ShineLobe& of_film,
                                        float inverse_pixel, std::size_t first, int count,
                                        const std::array<float*, 3>& planes) {
  const SkinVectors n = in.normal, half = in.half_way, m = in.rest_normal, p = in.rest_mm;
  const float *const shares = in.share, *const shown = in.shows, *const whites = in.white;
  const float* const depths = in.depth;
  float* __restrict red = planes[0], * __restrict green = planes[1], * __restrict blue = planes[2];
  const ShineLobe film = of_film;
  ORGANBAKE_INDEPENDENT
  for (unsigned j = 0; j < whole_vectors(count); ++j) {
    const std::size_t i = first + j;
    const float unit = 1 / std::sqrt(m.x[i] * m.x[i] + m.y[i] * m.y[i] + m.z[i] * m.z[i] + 1e-20f);
    const float rest[3] = {unit * m.x[i], unit * m.y[i], unit * m.z[i]};
    // On the side that is seen.
    const float facing = n.x[i] * half.x[i] + n.y[i] * half.y[i] + n.z[i] * half.z[i];
    const float of_normal = (facing < 0 ? -1.f : 1.f) /
                            std::sqrt(n.x[i] * n.x[i] + n.y[i] * n.y[i] + n.z[i] * n.z[i] + 1e-20f);
    const float normal[3] = {of_normal * n.x[i], of_normal * n.y[i], of_normal * n.z[i]};
    const float place[3] = {p.x[i], p.y[i], p.z[i]};
    const float toward[3] = {half.x[i], half.y[i], half.z[i]};
    const Mirror mirror = mirror_at(normal, rest, toward);
    const float pixels_per_mm = inverse_pixel / depths[i];
    const Hills hill =
        hills_at(hills, place, pixels_per_mm, std::make_index_sequence<WetFilm::kHills>());
    const float pixel = bumps.per_mm / pixels_per_mm;  // its side, in bumps
    // Some are higher than others.
    const float height = bumps.slope * (0.9f + 0.4f * hill.wet);
    const float across = height * WetFilm::kDome * pixel;
    const float wet = wetness(hill.wet);
    const LitLobe near(film, shares[i], hill.lost + WetFilm::kAcross * across * across);
    const LitLobe far(film, shares[i], hill.lost + WetFilm::kDropsVariance * height * height);
    const float whole = far.at(mirror.cosine2(hill.slopes));
    const float drops = light_of_drops(bumps, place, hill, wet, height, pixel, mirror, near);
    const float seen = at_most_1(positive(2 - 2 * pixel));
    const float mean = WetFilm::kDropShare * wet_bumps(wet) * whole;
    const float broken = seen * drops + (1 - seen) * mean;
    const float bright = whole + bumps.drops * (broken - whole);
    const float blown = bright < WetFilm::kBlown ? bright : WetFilm::kBlown;
    const float white = whites[i] * shown[i] * blown;
    red[i] += white, green[i] += white, blue[i] += white;
  }
}

}  // namespace

void WetFilm::add(const ScopeSpan& span, float inverse_pixel, unsigned first, int count,
                  const SpanColors& colors) const {
  const ScopeLit& lit = span.lit;
  const FilmPlanes planes = {lit.share,
                             lit.shows,
                             colors.white,
                             span.skin.depth_mm,
                             SkinVectors(span.skin.normals),
                             SkinVectors(lit.half_way),
                             SkinVectors(span.at_rest.normals),
                             SkinVectors(span.at_rest.places_mm)};
  film_pixels(planes, bumps_, hills_.data(), lobe_, inverse_pixel, first, count, colors.planes);
}

void WetFilm::describe(ScopeShading& shading) const {
  for (int k = 0; k < kHills; ++k) {
    const Wave& hill = hills_[k];
    shading.hills[k] = {{hill.x, hill.y, hill.z, hill.phase},
                        {hill.slope_x, hill.slope_y, hill.slope_z},
                        hill.length_mm,
                        hill.variance};
  }
  shading.bumps_per_mm = bumps_.per_mm, shading.bump_slope = bumps_.slope;
  shading.drops = bumps_.drops;
  shading.film = {lobe_.strength, lobe_.alpha2};
  shading.least_cosine = least_cosine_;
}

std::vector<ShaderConstant> WetFilm::constants() {
  return {{"kDome", kDome},
          {"kLean", kLean},
          {"kDropsVariance", kDropsVariance},
          {"kUpperHills", kUpperHills},
          {"kPatches", kPatches},
          {"kDriest", kDriest},
          {"kWetBumps", kWetBumps},
          {"kAskew", kAskew},
          {"kAcross", kAcross},
          {"kDrop", kDrop},
          {"kFlat", kFlat},
          {"kEdge", kEdge},
          {"kSoftEnds", kSoftEnds},
          {"kDropShare", kDropShare},
          {"kBlown", kBlown},
          {"kJitter", kJitter}};
}

}  // namespace organbake
