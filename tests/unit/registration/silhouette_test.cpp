// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "core/error.h"
#include "image/srgb.h"
#include "lamp_studio.h"
#include "registration/color_model.h"

namespace organbake {
namespace {

// The organ in one hue before a ground of squares in another and grey, all of the same luminance.
PhotoToRegister told_by_hue_alone() {
  const LampStudio& studio = lamp_studio();
  PhotoToRegister photo = studio.photo(studio.plain);
  const std::array<float, 3> skin = {0.30f, 0.1307f, 0.0f}, ground = {0.0f, 0.20f, 0.196f},
                             grey = {0.1572f, 0.1572f, 0.1572f};
  RandomStream random(5);
  for (int y = 0; y < photo.image.height; ++y)
    for (int x = 0; x < photo.image.width; ++x) {
      Ray ray;
      ray.origin = studio.cameras[0].center_world_mm();
      ray.direction = studio.cameras[0].camera_from_world.rotation.transpose() *
                      unproject(photo.intrinsics, {x + 0.5, y + 0.5});
      std::uint8_t organ = 0;
      studio.surface.scene().occluded({&ray, 1}, {&organ, 1});
      const auto& color = organ ? skin : (x / 12 + y / 12) % 2 ? ground : grey;
      for (int c = 0; c < 3; ++c)
        photo.image.at(x, y)[c] =
            srgb8_from_linear(color[c] + 0.004f * static_cast<float>(random.normal()));
    }
  return photo;
}

double silhouette_error_mm(const RegisteredPhoto& found) {
  return mtre_mm(lamp_studio().surface, lamp_studio().cameras[0].camera_from_world,
                 found.camera.camera_from_world);
}

TEST(ColorModel, TellsHuesApartThatALittleOfEachSideTaught) {
  Rgb8Image image(40, 20);
  std::vector<float> inside(800);
  for (int i = 0; i < 800; ++i) {
    const bool organ = i % 40 < 20;
    image.pixels[3 * i] = organ ? 150 : 90;
    image.pixels[3 * i + 1] = organ ? 90 : 122;
    image.pixels[3 * i + 2] = 60;
    inside[i] = i % 40 < 24 ? 1 : 0;  // four columns too many
  }
  inside[7] = -1;
  const auto probability = foreground_probability(image, inside);
  EXPECT_GT(probability[5], 0.9f);
  EXPECT_GT(probability[7], 0.9f) << "what was not asked is told by its colour as well";
  EXPECT_LT(probability[22], 0.3f) << "though it was taken for inside";
  EXPECT_LT(probability[35], 0.3f);
}

TEST(Silhouette, IsFoundByHueWhereBrightnessTellsNothing) {
  PhotoToRegister photo = told_by_hue_alone();
  RegistrationOptions options;
  options.similarity = Similarity::silhouette;
  constexpr double kByOutline_mm = 2;  // 2 px; turns about the organ's long axis show least
  for (const std::uint64_t seed : {1, 2, 3}) {
    photo.start =
        disturbed(lamp_studio().surface, lamp_studio().cameras[0].camera_from_world, 8, 6, seed);
    const auto found = register_photo(lamp_studio().surface, photo, options);
    EXPECT_LT(silhouette_error_mm(found), kByOutline_mm) << "seed " << seed;
    EXPECT_EQ(found.light, LightModel::flat);
    EXPECT_EQ(found.quality.verdict, Verdict::doubtful) << found.quality.reason;
  }
}

TEST(Silhouette, NeedsAStart) {
  RegistrationOptions options;
  options.similarity = Similarity::silhouette;
  EXPECT_THROW(
      register_photo(lamp_studio().surface, lamp_studio().photo(lamp_studio().plain), options),
      UsageError);
}

}  // namespace
}  // namespace organbake
