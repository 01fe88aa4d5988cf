// SPDX-License-Identifier: Apache-2.0
#include "light/scope_shine.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

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

}  // namespace

ScopeShine::ScopeShine(const Lighting& lighting)
    : scope_(lighting.scope.value_or(ScopeLight())), finish_(lighting.finish) {
  // Bumps of about one size, on hills of a few to twenty times that. Hills bend
  // the bumps' waves: waves alone would show as a lattice.
  constexpr double kLargestFine = 2.4, kSmallestCoarse = 4, kLargestCoarse = 20;
  constexpr double kFineShare = 0.8;  // of the slopes' variance
  const double fine = finish_.relief_slope * std::sqrt(kFineShare / kFine * 45 / 16);
  const double coarse = finish_.relief_slope * std::sqrt((1 - kFineShare) / kCoarse * 45 / 16);
  const auto between = [](double low, double high, double share) {
    return low * std::pow(high / low, share);
  };
  for (int k = 0; k < int(kFine); ++k) {
    const double share = double(k) / (kFine - 1);
    waves_[k] = make_wave(k, finish_.relief_mm * between(1, kLargestFine, share), fine);
    waves_[k].bend = static_cast<float>(0.55 - 1.1 * evenly(k, 3));
  }
  for (int k = 0; k < int(kCoarse); ++k) {
    const double size = between(kSmallestCoarse, kLargestCoarse, double(k) / (kCoarse - 1));
    waves_[kFine + k] = make_wave(kFine + k, finish_.relief_mm * size, coarse);
  }
  // From half-way: two deviations and a bit of the relief, and to where a lobe
  // hardly shows.
  constexpr double kHardlyShows = 0.01;
  double widest = 0;
  for (std::size_t k = 0; k < lighting.gloss.size() && k < lobes_.size(); ++k) {
    const double strength = lighting.gloss[k].strength;
    const double alpha2 = 2 / (lighting.gloss[k].exponent + 2);
    lobes_[k] = {static_cast<float>(strength), static_cast<float>(alpha2)};
    const double times = std::sqrt(std::max(1.0, strength / kHardlyShows)) - 1;
    widest = std::max(widest, std::sqrt(times * alpha2));
  }
  const double reach = std::min(1.4, 2.2 * finish_.relief_slope + widest);
  least_cosine_ = lighting.gloss.empty() ? 2 : static_cast<float>(std::cos(reach));
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

constexpr std::size_t kFine = ScopeShine::kFine, kCoarse = ScopeShine::kCoarse;

struct Relief {
  float x, y, z;  // its slope at rest, not yet along the skin
  float lost;     // variance of the slopes of what a pixel cannot show
  float wet;      // −1…1, slow
};

inline float phase_at(const Wave& w, float x, float y, float z) {
  return w.x * x + w.y * y + w.z * z + w.phase;
}

inline void add_wave(const Wave& w, float turns, float pixels_per_mm, Relief& relief) {
  const float resolved = 0.5f * w.length_mm * pixels_per_mm - 1;  // 1 from 4 pixels on
  const float low = resolved > 0 ? resolved : 0, share = low < 1 ? low : 1;
  const float height = share * wave_at(turns);
  relief.x += height * w.slope_x;
  relief.y += height * w.slope_y;
  relief.z += height * w.slope_z;
  relief.lost += (1 - share * share) * w.variance;
}

// Written out wave by wave: a loop in the loop over pixels would keep that from
// being vectorised.
template <std::size_t... fine, std::size_t... coarse>
inline __attribute__((always_inline)) Relief relief_at(const Wave* waves, float x, float y, float z,
                                                       float pixels_per_mm,
                                                       std::index_sequence<fine...>,
                                                       std::index_sequence<coarse...>) {
  Relief relief = {0, 0, 0, 0, 0};
  float bend = 0;
  const auto add_coarse = [&](const Wave& w) {
    const float turns = phase_at(w, x, y, z);
    bend += wave_at(turns + 0.25f);
    add_wave(w, turns, pixels_per_mm, relief);
  };
  (add_coarse(waves[kFine + coarse]), ...);
  relief.wet = 0.25f * bend;
  (add_wave(waves[fine], phase_at(waves[fine], x, y, z) + waves[fine].bend * bend, pixels_per_mm,
            relief),
   ...);
  return relief;
}

// Planes as the loops take them.
struct Direction {
  const float *x, *y, *z;

  explicit Direction(const SkinDirections& planes)
      : x(planes.of[0]), y(planes.of[1]), z(planes.of[2]) {}
};
struct GlossPlanes {
  const float *share, *shows, *white, *depth;
  Direction normal, half_way, rest_normal, rest_mm;
};

inline float positive(float v) { return v > 0 ? v : 0; }
inline float at_most_1(float v) { return v < 1 ? v : 1; }

// Diffuse light and the rim.
ORGANBAKE_MULTIVERSION void light_pixels(const Direction& normals, const float* __restrict depths,
                                         const float* __restrict whites,
                                         const ScopeShine::Frame& frame, const SkinFinish& finish,
                                         float least_cosine, int x0, int y, int count,
                                         ScopeLit& __restrict lit, float* __restrict red,
                                         float* __restrict green, float* __restrict blue) {
  const float row_x = frame.origin[0] + (static_cast<float>(y) + 0.5f) * frame.down[0];
  const float row_y = frame.origin[1] + (static_cast<float>(y) + 0.5f) * frame.down[1];
  const float row_z = frame.origin[2] + (static_cast<float>(y) + 0.5f) * frame.down[2];
  const float soft_r = static_cast<float>(finish.softness[0]);
  const float soft_g = static_cast<float>(finish.softness[1]);
  const float soft_b = static_cast<float>(finish.softness[2]);
  const float full_r = 1 / (1 + soft_r), full_g = 1 / (1 + soft_g), full_b = 1 / (1 + soft_b);
  const float rim = kSurroundings * static_cast<float>(finish.rim);
  const float inverse_fade = 1 / (kFade * (1 - least_cosine));
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
    const float mirrored = whites[i] * share * rim * grazing2 * grazing2 * grazing;
    red[i] = red[i] * share * positive((facing + soft_r) * full_r) + mirrored;
    green[i] = green[i] * share * positive((facing + soft_g) * full_g) + mirrored;
    blue[i] = blue[i] * share * positive((facing + soft_b) * full_b) + mirrored;
  }
}

// Gloss of some whole vectors from pixel `first` on.
ORGANBAKE_MULTIVERSION void gloss_pixels(const GlossPlanes& in, const Wave* waves,
                                         const ScopeShine::Lobe* lobes, float inverse_pixel,
                                         std::size_t first, int count, float* __restrict red,
                                         float* __restrict green, float* __restrict blue) {
  const Direction n = in.normal, half = in.half_way, m = in.rest_normal, p = in.rest_mm;
  const float *const shares = in.share, *const shown = in.shows, *const whites = in.white;
  const float* const depths = in.depth;
  for (unsigned k = 0; k < whole_vectors(count); ++k) {
    const std::size_t i = first + k;
    const float nx = n.x[i], ny = n.y[i], nz = n.z[i];
    float mx = m.x[i], my = m.y[i], mz = m.z[i];
    const float rest_scale = 1 / std::sqrt(mx * mx + my * my + mz * mz + 1e-20f);
    mx *= rest_scale, my *= rest_scale, mz *= rest_scale;
    const Relief relief =
        relief_at(waves, p.x[i], p.y[i], p.z[i], inverse_pixel / depths[i],
                  std::make_index_sequence<kFine>(), std::make_index_sequence<kCoarse>());
    float gx = relief.x, gy = relief.y, gz = relief.z;
    const float wet = at_most_1(positive(0.55f + 0.7f * relief.wet));
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
      const float wide = lobe.alpha2 + 2 * relief.lost, d = 1 - cosine2 * (1 - wide);
      return lobe.strength * lobe.alpha2 * wide / (d * d + 1e-12f);
    };
    const float mirrored = mirrored_by(lobes[0]) + mirrored_by(lobes[1]) + mirrored_by(lobes[2]) +
                           mirrored_by(lobes[3]);
    const float white = whites[i] * shares[i] * wet * shown[i] * mirrored;
    red[i] += white, green[i] += white, blue[i] += white;
  }
}

bool any_shows(const float* shows, unsigned count) {
  return std::any_of(shows, shows + count, [](float share) { return share > 0; });
}

}  // namespace

bool ScopeShine::light(const ScopeSkin& skin, const SpanColors& colors, ScopeLit& lit) const {
  const auto& [red, green, blue] = colors.planes;
  light_pixels(Direction(skin.normals), skin.depth_mm, colors.white, frame_, finish_, least_cosine_,
               colors.x0, colors.y, colors.count, lit, red, green, blue);
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
  const auto& [red, green, blue] = colors.planes;
  for (unsigned first = 0, end; first < whole_vectors(colors.count); first = end + kLanes) {
    for (end = first; end < whole_vectors(colors.count) && any_shows(lit.shows + end, kLanes);)
      end += kLanes;
    if (end == first) continue;
    gloss_pixels(planes, waves_.data(), lobes_.data(), frame_.inverse_pixel, first,
                 static_cast<int>(end - first), red, green, blue);
  }
}

}  // namespace organbake
