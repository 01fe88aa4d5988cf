// SPDX-License-Identifier: Apache-2.0
#include "light/scope_shine.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "light/grain_table.h"
#include "light/nearest_cell.h"
#include "picture/vector_loops.h"

namespace organbake {
namespace {

using Eigen::Vector3d;
using Wave = ScopeShine::Wave;

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
  const Vector3d toward(flat * std::cos(turn), flat * std::sin(turn), z);
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

std::array<float, 3> floats(const Vector3d& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

// Gloss fades out over this share of what 1 − cosine it may show up to.
constexpr float kFade = 0.3f;
constexpr float kSurroundings = 0.2f;  // of the light on the skin, that comes back from around it
constexpr float kNearest_mm2 = 1;      // of a light that touches the skin
constexpr float kOctaveStep = 0.47f;   // of the grain

}  // namespace

ScopeShine::ScopeShine(const Lighting& lighting)
    : scope_(lighting.scope.value_or(ScopeLight())), finish_(lighting.finish) {
  // Bumps of about one size, on hills of a few to twenty times that.
  constexpr double kSmallestHill = 5, kLargestHill = 19;
  constexpr double kHillShare = 0.3;  // of the slopes' variance
  const double hill = finish_.relief_slope * std::sqrt(kHillShare / kHills * 45 / 16);
  for (int k = 0; k < int(kHills); ++k) {
    const double size =
        kSmallestHill * std::pow(kLargestHill / kSmallestHill, double(k) / (kHills - 1));
    hills_[k] = make_wave(k, finish_.relief_mm * size, hill);
  }
  bumps_.per_mm = static_cast<float>(1 / finish_.relief_mm);
  bumps_.slope = static_cast<float>(finish_.relief_slope * std::sqrt(1 - kHillShare));
  rough_ = static_cast<float>(std::min(1.0, finish_.relief_slope / kBreaks));
  take_lobes(lighting.gloss);
}

// Wide lobes are the tissue's sheen, which no bump of the film scatters; narrow ones are the
// film's. Those show up to two deviations and a bit of the relief from half-way, and to where they
// hardly show.
void ScopeShine::take_lobes(const std::vector<Lighting::Lobe>& gloss) {
  constexpr double kHardlyShows = 0.01;
  double widest = 0;
  std::size_t narrow = 0, wide = 0;
  for (const Lighting::Lobe& lobe : gloss) {
    const double alpha2 = 2 / (lobe.exponent + 2);
    Lobe taken{static_cast<float>(lobe.strength), static_cast<float>(alpha2)};
    if (lobe.exponent < kWidestFilm) {
      if (wide < sheen_.size()) sheen_[wide++] = taken;
      continue;
    }
    if (narrow == film_.size()) continue;
    taken.alpha2 *= kFilmWidth;
    film_[narrow++] = taken;
    const double times = std::sqrt(std::max(1.0, lobe.strength / kHardlyShows)) - 1;
    widest = std::max(widest, std::sqrt(std::min(times, 4.0) * taken.alpha2));
  }
  const double reach = std::min(1.4, 2.2 * finish_.relief_slope + widest);
  least_cosine_ = narrow == 0 ? 2 : static_cast<float>(std::cos(reach));
}

void ScopeShine::look(const View& view, double reference_mm) {
  const Eigen::Matrix3d world_from_view = view.camera.camera_from_world.rotation.transpose();
  const Intrinsics& k = view.camera.intrinsics;
  const Vector3d right = world_from_view.col(0) / k.fx, down = world_from_view.col(1) / k.fy;
  frame_.right = floats(right);
  frame_.down = floats(down);
  frame_.origin = floats(world_from_view.col(2) - k.cx * right - k.cy * down);
  frame_.light = floats(world_from_view * scope_.offset_mm);
  frame_.forward = floats(world_from_view.col(2));
  frame_.full = static_cast<float>(scope_.gain * reference_mm * reference_mm);
  const double tan_half = std::tan(scope_.beam_half_angle_rad);
  frame_.inverse_tan2_half = static_cast<float>(1 / (tan_half * tan_half));
  frame_.inverse_pixel = static_cast<float>(0.5 * (k.fx + k.fy));
}

namespace {

struct Relief {
  float x, y, z;  // its slope at rest, not yet along the skin
  float lost;     // variance of the slopes of what a pixel cannot show
  float wet;      // 0…1
};

inline float positive(float v) { return v > 0 ? v : 0; }
inline float at_most_1(float v) { return v < 1 ? v : 1; }

inline float phase_at(const Wave& w, float x, float y, float z) {
  return w.x * x + w.y * y + w.z * z + w.phase;
}

// Of what is so many pixels long, how much a pixel can show: all from four on.
inline float resolved(float pixels) { return at_most_1(positive(0.5f * pixels - 1)); }

// Written out wave by wave: a loop in the loop over pixels would keep that from being vectorised.
template <std::size_t... k>
inline __attribute__((always_inline)) Relief hills_at(const Wave* hills, float x, float y, float z,
                                                      float pixels_per_mm,
                                                      std::index_sequence<k...>) {
  Relief relief = {0, 0, 0, 0, 0};
  const auto add = [&](const Wave& w) {
    const float turns = phase_at(w, x, y, z);
    const float share = resolved(w.length_mm * pixels_per_mm), height = share * wave_at(turns);
    relief.wet += wave_at(turns + 0.25f);
    relief.x += height * w.slope_x;
    relief.y += height * w.slope_y;
    relief.z += height * w.slope_z;
    relief.lost += (1 - share * share) * w.variance;
  };
  (add(hills[k]), ...);
  return relief;
}

// Planes as the loops take them.
struct Direction {
  const float *x, *y, *z;

  explicit Direction(const SkinDirections& planes)
      : x(planes.of[0]), y(planes.of[1]), z(planes.of[2]) {}
  Direction(const float* of_x, const float* of_y, const float* of_z) : x(of_x), y(of_y), z(of_z) {}
  // Its axes in another order.
  Direction turned() const { return {y, z, x}; }
};
struct GlossPlanes {
  const float *share, *shows, *white, *depth;
  Direction normal, half_way, rest_normal, rest_mm;
};

// Diffuse light, the sheen and the rim.
ORGANBAKE_MULTIVERSION void light_pixels(const Direction& normals, const float* __restrict depths,
                                         const float* __restrict whites,
                                         const ScopeShine::Frame& frame, const SkinFinish& finish,
                                         const ScopeShine::Lobe* sheen, float least_cosine, int x0,
                                         int y, int count, ScopeLit& __restrict lit,
                                         float* __restrict red, float* __restrict green,
                                         float* __restrict blue) {
  const float row_x = frame.origin[0] + (static_cast<float>(y) + 0.5f) * frame.down[0];
  const float row_y = frame.origin[1] + (static_cast<float>(y) + 0.5f) * frame.down[1];
  const float row_z = frame.origin[2] + (static_cast<float>(y) + 0.5f) * frame.down[2];
  const float soft_r = static_cast<float>(finish.softness[0]);
  const float soft_g = static_cast<float>(finish.softness[1]);
  const float soft_b = static_cast<float>(finish.softness[2]);
  const float full_r = 1 / (1 + soft_r), full_g = 1 / (1 + soft_g), full_b = 1 / (1 + soft_b);
  const float rim = kSurroundings * static_cast<float>(finish.rim);
  const float inverse_fade = 1 / (kFade * (1 - least_cosine));
  const ScopeShine::Lobe wide = sheen[0], wider = sheen[1];
  ORGANBAKE_INDEPENDENT
  for (unsigned i = 0; i < whole_vectors(count); ++i) {
    const float column = static_cast<float>(x0) + static_cast<float>(static_cast<int>(i)) + 0.5f;
    const float rx = row_x + column * frame.right[0], ry = row_y + column * frame.right[1];
    const float rz = row_z + column * frame.right[2];
    const float depth = depths[i];
    // Toward the light and the eye.
    float lx = frame.light[0] - depth * rx, ly = frame.light[1] - depth * ry;
    float lz = frame.light[2] - depth * rz;
    const float range2 = lx * lx + ly * ly + lz * lz;
    const float inverse_range = 1 / std::sqrt(range2 > kNearest_mm2 ? range2 : kNearest_mm2);
    lx *= inverse_range, ly *= inverse_range, lz *= inverse_range;
    const float to_eye = -1 / std::sqrt(rx * rx + ry * ry + rz * rz);
    const float ex = to_eye * rx, ey = to_eye * ry, ez = to_eye * rz;
    const float ahead =
        positive(-(lx * frame.forward[0] + ly * frame.forward[1] + lz * frame.forward[2]));
    const float ahead2 = ahead * ahead;
    const float beam = ahead2 / (ahead2 + (1 - ahead2) * frame.inverse_tan2_half + 1e-12f);
    const float share = frame.full * beam * inverse_range * inverse_range;
    float nx = normals.x[i], ny = normals.y[i], nz = normals.z[i];
    // Skin that is seen from behind, on the inside of a fold or a cut, has another side there.
    const float seen = nx * ex + ny * ey + nz * ez;
    const float scale = (seen < 0 ? -1.f : 1.f) / std::sqrt(nx * nx + ny * ny + nz * nz + 1e-20f);
    nx *= scale, ny *= scale, nz *= scale;
    float hx = lx + ex, hy = ly + ey, hz = lz + ez;
    const float to_half = 1 / std::sqrt(hx * hx + hy * hy + hz * hz + 1e-20f);
    hx *= to_half, hy *= to_half, hz *= to_half;
    const float facing = nx * lx + ny * ly + nz * lz;
    const float near = nx * hx + ny * hy + nz * hz;
    lit.share[i] = share;
    lit.shows[i] = at_most_1(positive((near - least_cosine) * inverse_fade)) *
                   at_most_1(8 * positive(facing)) * (seen < 0 ? 0.f : 1.f);
    lit.normal.of[0][i] = nx, lit.normal.of[1][i] = ny, lit.normal.of[2][i] = nz;
    lit.half_way.of[0][i] = hx, lit.half_way.of[1][i] = hy, lit.half_way.of[2][i] = hz;

    const float grazing = 1 - at_most_1(nx * ex + ny * ey + nz * ez);
    const float grazing2 = grazing * grazing;
    const float white = whites[i] * share;
    const float mirrored = white * rim * grazing2 * grazing2 * grazing;
    const auto veil = [&](const ScopeShine::Lobe& lobe) {
      const float d = 1 - near * near * (1 - lobe.alpha2);
      return lobe.strength * lobe.alpha2 * lobe.alpha2 / (d * d + 1e-12f);
    };
    const float both = white * (veil(wide) + veil(wider));
    const float veiled = near > 0 ? both : 0.f;
    red[i] = red[i] * share * positive((facing + soft_r) * full_r) + mirrored +
             ScopeShine::kSheen[0] * veiled;
    green[i] = green[i] * share * positive((facing + soft_g) * full_g) + mirrored +
               ScopeShine::kSheen[1] * veiled;
    blue[i] = blue[i] * share * positive((facing + soft_b) * full_b) + mirrored +
              ScopeShine::kSheen[2] * veiled;
  }
}

// What of the film a pixel shows.
struct Film {
  float x, y, z;  // slopes of hills and bumps at rest
  float lost, wet;
};

inline __attribute__((always_inline)) Film film_at(const ScopeShine::Bumps& bumps,
                                                   const Wave* hills, const float* p,
                                                   const float* m, float pixels_per_mm) {
  const Relief hill = hills_at(hills, p[0], p[1], p[2], pixels_per_mm,
                               std::make_index_sequence<ScopeShine::kHills>());
  const Cell cell = nearest_cell(bumps.per_mm * p[0], bumps.per_mm * p[1], bumps.per_mm * p[2]);
  // Along the skin from a bump's middle.
  const float out = cell.x * m[0] + cell.y * m[1] + cell.z * m[2];
  const float dx = cell.x - out * m[0], dy = cell.y - out * m[1], dz = cell.z - out * m[2];
  const float seen = resolved(pixels_per_mm / bumps.per_mm);
  // Domes that lean a little, higher in some places than in others.
  const float height = bumps.slope * (0.9f + 0.4f * hill.wet);
  const float dome = -ScopeShine::kDome * seen * height, lean = ScopeShine::kLean * seen * height;
  Film film;
  film.x = hill.x + dome * dx + lean * cell.chance(0);
  film.y = hill.y + dome * dy + lean * cell.chance(1);
  film.z = hill.z + dome * dz + lean * cell.chance(2);
  const float pixel = bumps.per_mm / pixels_per_mm;  // its side, in bumps
  const float across = height * ScopeShine::kDome * pixel;
  film.lost = hill.lost + (1 - seen * seen) * height * height + seen * across * across / 12;
  // The film breaks where the ground is high, and lies on some bumps only; between them it is a
  // valley that mirrors something else.
  const float patch = at_most_1(positive(0.5f + ScopeShine::kPatches * hill.wet));
  const float own = at_most_1(positive(ScopeShine::kWetBumps * patch + cell.chance(3)));
  // Ends of drops that are sharper than a pixel are as soft as one, so that they do not flicker.
  const float end = 1 / (ScopeShine::kEdge + ScopeShine::kSoftEnds * pixel);
  const float wall = at_most_1(end * cell.border);
  const float drop = at_most_1(positive(end * (ScopeShine::kDrop - cell.distance2)));
  const float border = drop < wall ? drop : wall;
  const float edge = border * border * (3 - 2 * border);
  film.wet = patch * ScopeShine::kOfBumps * (1 - seen) + seen * own * edge;
  return film;
}

// Gloss of some whole vectors from pixel `first` on.
ORGANBAKE_MULTIVERSION void gloss_pixels(const GlossPlanes& in, const ScopeShine::Bumps& bumps,
                                         const Wave* hills, const ScopeShine::Lobe* lobes,
                                         float rough, float inverse_pixel, std::size_t first,
                                         int count, const std::array<float*, 3>& planes) {
  const Direction n = in.normal, half = in.half_way, m = in.rest_normal, p = in.rest_mm;
  const float *const shares = in.share, *const shown = in.shows, *const whites = in.white;
  const float* const depths = in.depth;
  float* __restrict red = planes[0], * __restrict green = planes[1], * __restrict blue = planes[2];
  ORGANBAKE_INDEPENDENT
  for (unsigned k = 0; k < whole_vectors(count); ++k) {
    const std::size_t i = first + k;
    const float nx = n.x[i], ny = n.y[i], nz = n.z[i];
    float mx = m.x[i], my = m.y[i], mz = m.z[i];
    const float rest_scale = 1 / std::sqrt(mx * mx + my * my + mz * mz + 1e-20f);
    mx *= rest_scale, my *= rest_scale, mz *= rest_scale;
    const float place[3] = {p.x[i], p.y[i], p.z[i]}, normal[3] = {mx, my, mz};
    const Film film = film_at(bumps, hills, place, normal, inverse_pixel / depths[i]);
    float gx = film.x, gy = film.y, gz = film.z;
    // Along the skin at rest, then turned from normal to normal.
    const float out = gx * mx + gy * my + gz * mz;
    gx -= out * mx, gy -= out * my, gz -= out * mz;
    const float between = mx * nx + my * ny + mz * nz;
    const float lean = (gx * nx + gy * ny + gz * nz) / (1.001f + between);
    gx -= lean * (mx + nx), gy -= lean * (my + ny), gz -= lean * (mz + nz);
    const float qx = nx - gx, qy = ny - gy, qz = nz - gz;
    const float along = positive(qx * half.x[i] + qy * half.y[i] + qz * half.z[i]);
    const float cosine2 = along * along / (qx * qx + qy * qy + qz * qz + 1e-20f);
    const auto mirrored_by = [&](const ScopeShine::Lobe& lobe) {
      // The slopes of such a lobe have the variance α² / 4 along one direction.
      const float wide = lobe.alpha2 + 4 * film.lost;
      const float ratio = wide / (1 - cosine2 * (1 - wide) + 1e-12f), squared = ratio * ratio;
      return lobe.strength * lobe.alpha2 / wide * squared * squared;
    };
    const float mirrored = mirrored_by(lobes[0]) + mirrored_by(lobes[1]) + mirrored_by(lobes[2]) +
                           mirrored_by(lobes[3]);
    const float wet = 1 - rough * (1 - film.wet);
    // A pixel that the film covers in part shows that part of what its sensor can take.
    const float bright = shares[i] * mirrored;
    const float blown = bright < ScopeShine::kBlown ? bright : ScopeShine::kBlown;
    const float white = whites[i] * wet * shown[i] * blown;
    red[i] += white, green[i] += white, blue[i] += white;
  }
}

// Where octave k of the grain looks a pixel up. Each octave has its axes in another order, a
// little askew, so that no two repeat together.
struct GrainPlaces {
  alignas(64) std::int32_t at[ScopeShine::kOctaves][kSpan];
  alignas(64) float value[ScopeShine::kOctaves][kSpan];
};

ORGANBAKE_MULTIVERSION void find_grain(const Direction& p, float per_mm, int count,
                                       std::int32_t* __restrict at) {
  constexpr std::int32_t kMask = GrainTable::kSide - 1;
  constexpr int kBits = GrainTable::kBits;
  const auto whole = [](float v) { return static_cast<std::int32_t>(std::floor(v)) & kMask; };
  for (unsigned i = 0; i < whole_vectors(count); ++i) {
    const float x = per_mm * p.x[i], y = per_mm * p.y[i], z = per_mm * p.z[i];
    at[i] =
        whole(x + 0.31f * y) << (2 * kBits) | whole(y + 0.27f * z) << kBits | whole(z - 0.29f * x);
  }
}

ORGANBAKE_MULTIVERSION void multiply_by_grain(const GrainPlaces& grain, const float* depths,
                                              float grain_px, const std::array<float, 3>& shares,
                                              int count, const std::array<float*, 3>& planes) {
  float* __restrict red = planes[0], * __restrict green = planes[1], * __restrict blue = planes[2];
  constexpr float kPart = 0.65f / GrainTable::kDeviation, kLeast = 0.15f;
  ORGANBAKE_INDEPENDENT
  for (unsigned i = 0; i < whole_vectors(count); ++i) {
    const float px = grain_px / depths[i];
    const float a = resolved(px) * grain.value[0][i];
    const float b = resolved(px * kOctaveStep) * grain.value[1][i];
    const float c = resolved(px * kOctaveStep * kOctaveStep) * grain.value[2][i];
    const float tone = kPart * (a + 0.9f * b + 0.7f * c), hue = kPart * 0.4f * (b - a);
    const auto times = [&](float share, float of_hue) {
      const float by = 1 + share * (tone + of_hue * hue);
      return by > kLeast ? by : kLeast;
    };
    red[i] *= times(shares[0], -0.5f);
    green[i] *= times(shares[1], 0.3f);
    blue[i] *= times(shares[2], 0.6f);
  }
}

// Without an early end, which would ask one by one.
bool any_shows(const float* shows, unsigned count) {
  int any = 0;
  for (unsigned i = 0; i < count; ++i) any |= shows[i] > 0;
  return any != 0;
}

}  // namespace

bool ScopeShine::grain_shows(float depth_mm) const {
  constexpr double kLeast_px = 2;
  return finish_.grain.maxCoeff() > 0 &&
         finish_.grain_mm * frame_.inverse_pixel > kLeast_px * depth_mm;
}

void ScopeShine::add_grain(const ScopeSkin& skin, const ScopeSkinAtRest& at_rest, float nearest_mm,
                           const SpanColors& colors) const {
  const std::int8_t* const table = GrainTable::shared().data();
  GrainPlaces grain;
  const Direction place(at_rest.places_mm);
  const Direction other = place.turned(), third = other.turned();
  float per_mm = GrainTable::kPerGrain / static_cast<float>(finish_.grain_mm);
  const std::array<const Direction*, kOctaves> places = {&place, &other, &third};
  const float grain_px = frame_.inverse_pixel * static_cast<float>(finish_.grain_mm);
  float most_px = grain_px / nearest_mm;
  for (int k = 0; k < kOctaves; ++k, per_mm /= kOctaveStep, most_px *= kOctaveStep) {
    // What no pixel of the span shows needs not be looked up.
    if (resolved(most_px) <= 0) {
      std::fill_n(grain.value[k], kSpan, 0.f);
      continue;
    }
    find_grain(*places[k], per_mm, colors.count, grain.at[k]);
    for (unsigned i = 0; i < whole_vectors(colors.count); ++i)
      grain.value[k][i] = table[grain.at[k][i]];
  }
  multiply_by_grain(grain, skin.depth_mm, grain_px, floats(finish_.grain), colors.count,
                    colors.planes);
}

bool ScopeShine::light(const ScopeSkin& skin, const SpanColors& colors, ScopeLit& lit) const {
  const auto& [red, green, blue] = colors.planes;
  light_pixels(Direction(skin.normals), skin.depth_mm, colors.white, frame_, finish_, sheen_.data(),
               least_cosine_, colors.x0, colors.y, colors.count, lit, red, green, blue);
  return any_shows(lit.shows, static_cast<unsigned>(colors.count));
}

void ScopeShine::add_gloss(const ScopeLit& lit, const ScopeSkin& skin,
                           const ScopeSkinAtRest& at_rest, const SpanColors& colors) const {
  const GlossPlanes planes = {lit.share,
                              lit.shows,
                              colors.white,
                              skin.depth_mm,
                              Direction(lit.normal),
                              Direction(lit.half_way),
                              Direction(at_rest.normals),
                              Direction(at_rest.places_mm)};
  for (unsigned first = 0, end; first < whole_vectors(colors.count); first = end + kLanes) {
    for (end = first; end < whole_vectors(colors.count) && any_shows(lit.shows + end, kLanes);)
      end += kLanes;
    if (end == first) continue;
    gloss_pixels(planes, bumps_, hills_.data(), film_.data(), rough_, frame_.inverse_pixel, first,
                 static_cast<int>(end - first), colors.planes);
  }
}

ScopeShading ScopeShine::shading() const {
  ScopeShading out;
  for (int k = 0; k < kHills; ++k) {
    const Wave& hill = hills_[k];
    out.hills[k] = {{hill.x, hill.y, hill.z, hill.phase},
                    {hill.slope_x, hill.slope_y, hill.slope_z},
                    hill.length_mm,
                    hill.variance};
  }
  out.bumps_per_mm = bumps_.per_mm, out.bump_slope = bumps_.slope, out.rough = rough_;
  for (int k = 0; k < kMostLobes; ++k) out.film[k] = {film_[k].strength, film_[k].alpha2};
  for (int k = 0; k < 2; ++k) out.sheen[k] = {sheen_[k].strength, sheen_[k].alpha2};
  out.least_cosine = least_cosine_;
  out.light = frame_.light, out.forward = frame_.forward;
  out.full = frame_.full;
  out.inverse_tan2_half = frame_.inverse_tan2_half, out.inverse_pixel = frame_.inverse_pixel;
  return out;
}

std::vector<ShaderConstant> ScopeShine::constants() {
  return {{"kSheenRed", kSheen[0]},
          {"kSheenGreen", kSheen[1]},
          {"kSheenBlue", kSheen[2]},
          {"kDome", kDome},
          {"kLean", kLean},
          {"kPatches", kPatches},
          {"kEdge", kEdge},
          {"kWetBumps", kWetBumps},
          {"kDrop", kDrop},
          {"kSoftEnds", kSoftEnds},
          {"kBlown", kBlown},
          {"kOfBumps", kOfBumps},
          {"kFade", kFade},
          {"kSurroundings", kSurroundings},
          {"kNearest_mm2", kNearest_mm2},
          {"kOctaveStep", kOctaveStep},
          {"kPerGrain", GrainTable::kPerGrain},
          {"kGrainDeviation", GrainTable::kDeviation}};
}

}  // namespace organbake
