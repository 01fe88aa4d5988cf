// SPDX-License-Identifier: Apache-2.0
// The light at the scope by the pixel: grain, diffuse light, sheen and rim. Its film is in
// wet_film.cpp.
#include "light/scope_shine.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "picture/spans.h"

namespace organbake {
namespace {

constexpr float kTone = 0.65f;  // of a share, the largest octave's deviation

// Where octave k of the grain looks a pixel up. Each octave has its axes in another order, a
// little askew, so that no two repeat together.
struct GrainPlaces {
  alignas(64) std::int32_t at[SkinGrain::kOctaves][kSpan];
  alignas(64) float value[SkinGrain::kOctaves][kSpan];
};

ORGANBAKE_MULTIVERSION void find_grain(const SkinVectors& p, float per_mm, int count,
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
  constexpr float kPart = kTone / GrainTable::kDeviation, kLeast = 0.15f;
  ORGANBAKE_INDEPENDENT
  for (unsigned i = 0; i < whole_vectors(count); ++i) {
    const float px = grain_px / depths[i];
    const float a = resolved(px) * grain.value[0][i];
    const float b = resolved(px * SkinGrain::kOctaveStep) * grain.value[1][i];
    const float c =
        resolved(px * SkinGrain::kOctaveStep * SkinGrain::kOctaveStep) * grain.value[2][i];
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

}  // namespace

bool SkinGrain::shows(float depth_mm, float inverse_pixel) const {
  return grain_mm_ > 0 && resolved(grain_mm_ * inverse_pixel / depth_mm) > 0;
}

void SkinGrain::add(const ScopeSkin& skin, const ScopeSkinAtRest& at_rest, float inverse_pixel,
                    float nearest_mm, const SpanColors& colors) const {
  const std::int8_t* const table = GrainTable::shared().data();
  GrainPlaces grain;
  const SkinVectors place(at_rest.places_mm);
  const SkinVectors other = place.turned(), third = other.turned();
  float per_mm = GrainTable::kPerGrain / grain_mm_;
  const std::array<const SkinVectors*, kOctaves> places = {&place, &other, &third};
  const float grain_px = inverse_pixel * grain_mm_;
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
  multiply_by_grain(grain, skin.depth_mm, grain_px, shares_, colors.count, colors.planes);
}

namespace {

using Eigen::Vector3d;

std::array<float, 3> floats(const Vector3d& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

constexpr float kSurroundings = 0.2f;  // of the light on the skin, that comes back from around it
constexpr float kNearest_mm2 = 1;      // of a light that touches the skin

}  // namespace

ScopeShine::ScopeShine(const Lighting& lighting)
    : scope_(lighting.scope.value_or(ScopeLight())),
      finish_(lighting.finish),
      film_(lighting),
      grain_(lighting.finish) {
  std::size_t wide = 0;
  for (const Lighting::Lobe& lobe : lighting.gloss)
    if (lobe.exponent < WetFilm::kWidestFilm && wide < sheen_.size())
      sheen_[wide++] = {static_cast<float>(lobe.strength),
                        static_cast<float>(2 / (lobe.exponent + 2))};
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

// Diffuse light, the sheen and the rim.
ORGANBAKE_MULTIVERSION void light_pixels(const SkinVectors& normals, const float* __restrict depths,
                                         const float* __restrict whites,
                                         const ScopeShine::Frame& frame, const SkinFinish& finish,
                                         const ShineLobe* sheen, const FilmReach& film, int x0,
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
  const FilmReach reach = film;
  const ShineLobe wide = sheen[0], wider = sheen[1];
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
    lit.shows[i] = at_most_1(positive((near - reach.least_cosine) * reach.inverse_fade)) *
                   at_most_1(8 * positive(facing)) * (seen < 0 ? 0.f : 1.f);
    lit.half_way.of[0][i] = hx, lit.half_way.of[1][i] = hy, lit.half_way.of[2][i] = hz;

    const float grazing = 1 - at_most_1(nx * ex + ny * ey + nz * ez);
    const float grazing2 = grazing * grazing;
    const float white = whites[i] * share;
    const float mirrored = white * rim * grazing2 * grazing2 * grazing;
    const auto veil = [&](const ShineLobe& lobe) {
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

}  // namespace

bool ScopeShine::light(const ScopeSkin& skin, const SpanColors& colors, ScopeLit& lit) const {
  const auto& [red, green, blue] = colors.planes;
  light_pixels(SkinVectors(skin.normals), skin.depth_mm, colors.white, frame_, finish_,
               sheen_.data(), film_.reach(), colors.x0, colors.y, colors.count, lit, red, green,
               blue);
  return any_shows(lit.shows, static_cast<unsigned>(colors.count));
}

ScopeShading ScopeShine::shading() const {
  ScopeShading out;
  film_.describe(out);
  for (const ShineLobe& lobe : sheen_) out.sheen.emplace_back(lobe.strength, lobe.alpha2);
  out.light = Eigen::Vector3f(frame_.light.data());
  out.forward = Eigen::Vector3f(frame_.forward.data());
  out.scope = {frame_.full, frame_.inverse_tan2_half, frame_.inverse_pixel};
  return out;
}

std::vector<ShaderConstant> ScopeShine::constants() {
  std::vector<ShaderConstant> all = {{"kSheen", kSheen},
                                     {"kSurroundings", kSurroundings},
                                     {"kNearest_mm2", kNearest_mm2},
                                     {"kOctaveStep", SkinGrain::kOctaveStep},
                                     {"kPerGrain", GrainTable::kPerGrain},
                                     {"kGrainDeviation", GrainTable::kDeviation}};
  const std::vector<ShaderConstant> film = WetFilm::constants();
  all.insert(all.end(), film.begin(), film.end());
  return all;
}

}  // namespace organbake
