// SPDX-License-Identifier: Apache-2.0
#include "skin_light.h"

#include <algorithm>

#include "opengl.h"
#include "organbake/warp/organ_source.h"

namespace organbake {
namespace {

Eigen::Vector3f vector_of(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

}  // namespace

void SkinLightUniforms::set(const Program& program, const Warper& warper, const Lighting* lighting,
                            const View& view, DrawnLight light, double reference_mm) {
  program.set("light", lighting ? static_cast<int>(light) : 0);
  if (!has_noise_) fill_noise();
  program.set_texture("noise", GL_TEXTURE_3D, noise_.name());
  if (!lighting || light == DrawnLight::baked) return;
  program.set("view_lens", lens_of(view.camera.intrinsics));
  program.set("world_from_view",
              Eigen::Matrix3f(view.camera.camera_from_world.rotation.transpose().cast<float>()));
  program.set("above", Eigen::Vector3f(lighting->ambient_above.cast<float>()));
  program.set("below", Eigen::Vector3f(lighting->ambient_below.cast<float>()));
  program.set("up", Eigen::Vector3f(lighting->up.cast<float>()));
  constexpr std::size_t kMostLamps = 16, kMostLobes = 4;  // that a bundle may have
  std::array<Eigen::Vector3f, kMostLamps> toward, color;
  const std::size_t lamps = std::min(kMostLamps, lighting->lamps.size());
  for (std::size_t i = 0; i < lamps; ++i) {
    toward[i] = lighting->lamps[i].toward.cast<float>();
    color[i] = lighting->lamps[i].color.cast<float>();
  }
  std::array<Eigen::Vector2f, kMostLobes> lobes;
  const std::size_t lobe_count = std::min(kMostLobes, lighting->gloss.size());
  for (std::size_t i = 0; i < lobe_count; ++i)
    lobes[i] = {float(lighting->gloss[i].strength), float(lighting->gloss[i].exponent)};
  program.set("lamps", static_cast<int>(lamps));
  program.set("lamp_toward", std::span<const Eigen::Vector3f>(toward).first(lamps));
  program.set("lamp_color", std::span<const Eigen::Vector3f>(color).first(lamps));
  program.set("lobes", static_cast<int>(lobe_count));
  program.set("lobe", std::span<const Eigen::Vector2f>(lobes).first(lobe_count));
  if (light == DrawnLight::scope)
    set_scope(program, warper.scope_shading(view, reference_mm), lighting->finish);
}

void SkinLightUniforms::set_scope(const Program& program, const ScopeShading& s,
                                  const SkinFinish& finish) {
  std::array<Eigen::Vector4f, 4> phase, slope;
  Eigen::Vector4f variance;
  for (int i = 0; i < 4; ++i) {
    const ScopeShading::Wave& hill = s.hills[i];
    phase[i] = {hill.phase[0], hill.phase[1], hill.phase[2], hill.phase[3]};
    slope[i] = {hill.slope[0], hill.slope[1], hill.slope[2], hill.length_mm};
    variance[i] = hill.variance;
  }
  std::array<Eigen::Vector2f, 2> sheen;
  for (int i = 0; i < 2; ++i) sheen[i] = {s.sheen[i].strength, s.sheen[i].alpha2};
  program.set("hill_phase", std::span<const Eigen::Vector4f>(phase));
  program.set("hill_slope", std::span<const Eigen::Vector4f>(slope));
  program.set("hill_variance", variance);
  program.set("bumps", Eigen::Vector3f(s.bumps_per_mm, s.bump_slope, s.drops));
  program.set("film", Eigen::Vector2f(s.film.strength, s.film.alpha2));
  program.set("sheen", std::span<const Eigen::Vector2f>(sheen));
  program.set("scope_light", vector_of(s.light));
  program.set("scope_forward", vector_of(s.forward));
  program.set("scope",
              Eigen::Vector4f(s.full, s.inverse_tan2_half, s.inverse_pixel, s.least_cosine));
  program.set("softness", Eigen::Vector3f(finish.softness.cast<float>()));
  program.set("grain", Eigen::Vector3f(finish.grain.cast<float>()));
  program.set("rim", static_cast<float>(finish.rim));
  program.set("grain_mm", static_cast<float>(finish.grain_mm));
}

void SkinLightUniforms::fill_noise() {
  glBindTexture(GL_TEXTURE_3D, noise_.name());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexImage3D(GL_TEXTURE_3D, 0, GL_R8I, kGrainSide, kGrainSide, kGrainSide, 0, GL_RED_INTEGER,
               GL_BYTE, grain_noise().data());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  set_nearest(GL_TEXTURE_3D);
  has_noise_ = true;
}

}  // namespace organbake
