// SPDX-License-Identifier: Apache-2.0
// The light at the scope by the pixel: grain, diffuse light, sheen and rim. Its film is in
// wet_film.cpp.
#include "light/scope_shine.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace organbake {
namespace {

constexpr float kTone = 0.65f;  // of a share, the largest octave's deviation

constexpr int kPixels = SparseShading::kPixels;

// Where octave k of the grain looks a pixel up. Each octave has its axes in another order, a
// little askew, so that no two repeat together.
struct GrainPlaces {
  alignas(64) std::int32_t at[SkinGrain::kOctaves][kPixels];
  alignas(64) float value[SkinGrain::kOctaves][kPixels];
};

ORGANBAKE_MULTIVERSION void find_grain(const SkinPlanes& places_mm, int first, int octave,
                                       float per_mm, std::int32_t* __restrict at) {
  const auto whole = [](float v) {
    return static_cast<std::int32_t>(std::floor(v)) & (kGrainSide - 1);
  };
  const auto axis = [&](int k) { return places_mm.of[(octave + k) % 3] + first; };
  const float *const of_x = axis(0), *const of_y = axis(1), *const of_z = axis(2);
  for (int i = 0; i < kPixels; ++i) {
    const float x = per_mm * of_x[i], y = per_mm * of_y[i], z = per_mm * of_z[i];
    at[i] = (whole(x + 0.31f * y) * kGrainSide + whole(y + 0.27f * z)) * kGrainSide +
            whole(z - 0.29f * x);
  }
}

ORGANBAKE_MULTIVERSION void multiply_by_grain(const GrainPlaces& grain, const float* depths,
                                              float grain_px, const std::array<float, 3>& shares,
                                              SkinPlanes& __restrict colors) {
  constexpr float kPart = kTone / SkinGrain::kDeviation, kLeast = 0.15f;
  const float share_r = shares[0], share_g = shares[1], share_b = shares[2];
  ORGANBAKE_INDEPENDENT
  for (int i = 0; i < kPixels; ++i) {
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
    colors.of[0][i] *= times(share_r, -0.5f);
    colors.of[1][i] *= times(share_g, 0.3f);
    colors.of[2][i] *= times(share_b, 0.6f);
  }
}

}  // namespace

bool SkinGrain::shows(float depth_mm, float inverse_pixel) const {
  return grain_mm_ > 0 && resolved(grain_mm_ * inverse_pixel / depth_mm) > 0;
}

void SkinGrain::multiply(const ScopeSkin& skin, int first, float nearest_mm, float inverse_pixel,
                         SkinPlanes& colors) const {
  const std::int8_t* const table = grain_noise().data();
  GrainPlaces grain;
  float per_mm = kPerGrain / grain_mm_;
  const float grain_px = inverse_pixel * grain_mm_;
  float most_px = grain_px / nearest_mm;
  for (int k = 0; k < kOctaves; ++k, per_mm /= kOctaveStep, most_px *= kOctaveStep) {
    // What no pixel shows needs not be looked up.
    if (resolved(most_px) <= 0) {
      std::fill_n(grain.value[k], kPixels, 0.f);
      continue;
    }
    find_grain(skin.rest_mm, first, k, per_mm, grain.at[k]);
    for (int i = 0; i < kPixels; ++i) grain.value[k][i] = table[grain.at[k][i]];
  }
  multiply_by_grain(grain, skin.depth_mm + first, grain_px, shares_, colors);
}

namespace {

using Eigen::Vector3d;

std::array<float, 3> floats(const Vector3d& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

constexpr float kSurroundings = 0.2f;  // of the light on the skin, that comes back from around it

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
  view_.right = floats(right);
  view_.down = floats(down);
  view_.origin = floats(world_from_view.col(2) - k.cx * right - k.cy * down);
  view_.light = floats(world_from_view * scope_.offset_mm);
  view_.forward = floats(world_from_view.col(2));
  view_.full = static_cast<float>(scope_.gain * reference_mm * reference_mm);
  const double tan_half = std::tan(scope_.beam_half_angle_rad);
  view_.inverse_tan2_half = static_cast<float>(1 / (tan_half * tan_half));
  view_.inverse_pixel = static_cast<float>(0.5 * (k.fx + k.fy));
}

namespace {

// Diffuse light, the sheen and the rim.
ORGANBAKE_MULTIVERSION void light_skin(const ScopeSkin& __restrict skin, const ScopeView view,
                                       const SkinFinish& finish, const ShineLobe* sheen,
                                       float least_near_cosine, ScopeLit& __restrict lit) {
  const float soft_r = static_cast<float>(finish.softness[0]);
  const float soft_g = static_cast<float>(finish.softness[1]);
  const float soft_b = static_cast<float>(finish.softness[2]);
  const float full_r = 1 / (1 + soft_r), full_g = 1 / (1 + soft_g), full_b = 1 / (1 + soft_b);
  const float rim = kSurroundings * static_cast<float>(finish.rim);
  const ShineLobe wide = sheen[0], wider = sheen[1];
  ORGANBAKE_INDEPENDENT
  for (unsigned i = 0; i < whole_vectors(skin.count); ++i) {
    const ScopeRay ray = scope_ray(view, skin.column[i], skin.row[i], skin.depth_mm[i]);
    const auto& [lx, ly, lz] = ray.light;
    const auto& [ex, ey, ez] = ray.eye;
    const auto& [hx, hy, hz] = ray.half_way;
    float nx = skin.normals.of[0][i], ny = skin.normals.of[1][i], nz = skin.normals.of[2][i];
    // Skin that is seen from behind, on the inside of a fold or a cut, has another side there.
    const float seen = nx * ex + ny * ey + nz * ez;
    const float scale = (seen < 0 ? -1.f : 1.f) / std::sqrt(nx * nx + ny * ny + nz * nz + 1e-20f);
    nx *= scale, ny *= scale, nz *= scale;
    const float facing = nx * lx + ny * ly + nz * lz;
    const float near = nx * hx + ny * hy + nz * hz;
    const float grazing = 1 - at_most_1(nx * ex + ny * ey + nz * ez);
    const float grazing2 = grazing * grazing;
    const auto veil = [&](const ShineLobe& lobe) {
      const float d = 1 - near * near * (1 - lobe.alpha2);
      return lobe.strength * lobe.alpha2 * lobe.alpha2 / (d * d + 1e-12f);
    };
    const float both = ray.share * (veil(wide) + veil(wider));
    lit.sheen[i] = near > 0 ? both : 0.f;
    lit.rim[i] = ray.share * rim * grazing2 * grazing2 * grazing;
    lit.times.of[0][i] *= ray.share * positive((facing + soft_r) * full_r);
    lit.times.of[1][i] *= ray.share * positive((facing + soft_g) * full_g);
    lit.times.of[2][i] *= ray.share * positive((facing + soft_b) * full_b);
    lit.film_near[i] = near > least_near_cosine;
  }
}

}  // namespace

void ScopeShine::light(const ScopeSkin& skin, ScopeLit& lit) const {
  light_skin(skin, view_, finish_, sheen_.data(), film_.reach().least_near_cosine, lit);
}

void WetFilm::describe(ScopeShading& shading) const {
  for (std::size_t k = 0; k < hills_.size(); ++k) {
    const Wave& hill = hills_[k];
    shading.hill_phase.emplace_back(hill.x, hill.y, hill.z, hill.phase);
    shading.hill_slope.emplace_back(hill.slope_x, hill.slope_y, hill.slope_z, hill.length_mm);
    shading.hill_variance[Eigen::Index(k)] = hill.variance;
  }
  shading.drops = {drops_.per_mm, drops_.lean, drops_.inverse_lit2, drops_.lean2};
  shading.film = {lobe_.strength, lobe_.alpha2, reach_.least_cosine, reach_.inverse_fade};
}

ScopeShading ScopeShine::shading() const {
  ScopeShading out;
  film_.describe(out);
  for (const ShineLobe& lobe : sheen_) out.sheen.emplace_back(lobe.strength, lobe.alpha2);
  out.light = Eigen::Vector3f(view_.light.data());
  out.forward = Eigen::Vector3f(view_.forward.data());
  out.scope = {view_.full, view_.inverse_tan2_half, view_.inverse_pixel};
  return out;
}

std::vector<ShaderConstant> WetFilm::constants() {
  return {{"kUpperHills", kUpperHills}, {"kPatches", kPatches}, {"kDriest", kDriest},
          {"kWetBumps", kWetBumps},     {"kAskew", kAskew},     {"kBridges_mm", kBridges_mm},
          {"kCrease", kCrease},         {"kDrop", kDrop},       {"kRun", kRun},
          {"kGrows", kGrows},           {"kEdge", kEdge},       {"kSoftEnds", kSoftEnds},
          {"kBlown", kBlown},           {"kJitter", kJitter}};
}

std::vector<ShaderConstant> ScopeShine::constants() {
  std::vector<ShaderConstant> all = WetFilm::constants();
  all.insert(all.end(), {{"kSheen", kSheen},
                         {"kSurroundings", kSurroundings},
                         {"kNearest_mm2", ScopeRay::kNearest_mm2},
                         {"kOctaveStep", SkinGrain::kOctaveStep},
                         {"kPerGrain", SkinGrain::kPerGrain},
                         {"kGrainDeviation", SkinGrain::kDeviation}});
  return all;
}

}  // namespace organbake
