// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "lamp_studio.h"

namespace organbake {
namespace {

RegisteredPhoto found_under(const PhotoLight& light, std::uint64_t seed) {
  const LampStudio& studio = lamp_studio();
  const LampScene scene{false, false, light};
  PhotoToRegister photo = studio.photo(
      picture_of_mesh_by_lamp(studio.surface.mesh(), studio.cameras[0], scene), {.noise = 0.01});
  photo.start = disturbed(studio.surface, studio.cameras[0].camera_from_world, 5, 5, seed);
  return register_photo(studio.surface, photo, {});
}

double lit_error_mm(const RegisteredPhoto& found) {
  return mtre_mm(lamp_studio().surface, lamp_studio().cameras[0].camera_from_world,
                 found.camera.camera_from_world);
}

constexpr double kRight_mm = 0.25;  // a quarter of a pixel

TEST(LightChoice, TheLampAtTheLensIsTakenForWhatItIs) {
  const auto found = found_under({}, 1);
  EXPECT_EQ(found.light, LightModel::camera) << name_of(found.light);
  EXPECT_LT(lit_error_mm(found), kRight_mm);
}

TEST(LightChoice, ABeamBesideTheLensIsNot) {
  PhotoLight light;
  light.lamp_camera_mm = {9, -4, 0};
  light.beam_exponent = 5;
  const auto found = found_under(light, 2);
  EXPECT_NE(found.light, LightModel::camera);
  EXPECT_LT(lit_error_mm(found), kRight_mm);
  EXPECT_EQ(found.quality.verdict, Verdict::ok) << found.quality.reason;
}

TEST(LightChoice, LightFromAfarIsEstimated) {
  PhotoLight light;
  light.toward = {0.6, -0.5, -1};
  const auto found = found_under(light, 3);
  EXPECT_EQ(found.light, LightModel::estimated) << name_of(found.light);
  EXPECT_LT(lit_error_mm(found), kRight_mm);
  EXPECT_EQ(found.quality.verdict, Verdict::ok) << found.quality.reason;
}

TEST(LightChoice, WhatIsGivenStands) {
  PhotoToRegister photo = lamp_studio().photo(lamp_studio().plain);
  photo.start = lamp_studio().cameras[0].camera_from_world;
  RegistrationOptions options;
  options.light = LightModel::beam;
  EXPECT_EQ(register_photo(lamp_studio().surface, photo, options).light, LightModel::beam);
}

}  // namespace
}  // namespace organbake
