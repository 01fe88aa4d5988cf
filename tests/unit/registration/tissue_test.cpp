// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "appearance/appearance.h"
#include "color/tissue_colors.h"
#include "color/tissue_light.h"
#include "lamp_studio.h"
#include "support/meshes.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

TissueLight::Weights some_light() {
  TissueLight::Weights w = TissueLight::expected().mean;
  w[TissueLight::kGain] = 0.4;
  w[TissueLight::kLampX] = 5;
  w[TissueLight::kLampY] = -3;
  w[TissueLight::kTiltU] = 0.3;
  w[TissueLight::kTiltV] = -0.6;
  w[TissueLight::kBeam] = -2;
  w[TissueLight::kFalloff] = 0.2;
  return w;
}

TEST(TissueLight, WhatFacesALampAtTheLensFromTheReferenceIsAsBrightAsItsGain) {
  TissueLight::Weights w = TissueLight::Weights::Zero();
  EXPECT_NEAR(log_radiance({0, 0, 90}, {0, 0, -1}, w, 90), 0, 1e-12);
  w[TissueLight::kGain] = 0.7;
  EXPECT_NEAR(log_radiance({0, 0, 180}, {0, 0, -1}, w, 90), 0.7 - std::log(4), 1e-12)
      << "falls with the distance squared";
}

TEST(TissueLight, SlopesAreTheFiniteDifferences) {
  const Vector3d x(12, -25, 80), n = Vector3d(0.3, 0.2, -0.9).normalized();
  const TissueLight::Weights w = some_light();
  const LogRadianceSlopes s = log_radiance_slopes(x, n, w, 70);
  constexpr double kStep = 1e-5, kTolerance = 1e-7;
  for (int j = 0; j < 3; ++j) {
    const Vector3d d = kStep * Vector3d::Unit(j);
    EXPECT_NEAR(s.by_point[j],
                (log_radiance(x + d, n, w, 70) - log_radiance(x - d, n, w, 70)) / (2 * kStep),
                kTolerance);
    EXPECT_NEAR(s.by_normal[j],
                (log_radiance(x, n + d, w, 70) - log_radiance(x, n - d, w, 70)) / (2 * kStep),
                kTolerance);
  }
  for (int j = 0; j < TissueLight::kShape; ++j) {
    TissueLight::Weights d = TissueLight::Weights::Zero();
    d[j] = kStep;
    EXPECT_NEAR(s.by_weight[j],
                (log_radiance(x, n, w + d, 70) - log_radiance(x, n, w - d, 70)) / (2 * kStep),
                kTolerance)
        << "weight " << j;
  }
}

class Tissue : public testing::Test {
 protected:
  const PosedCamera& camera_ = lamp_studio().cameras[0];
  const Vector3d up_ = camera_.camera_from_world.rotation.row(1).transpose();
  const RegisteredSurface surface_{cut_in_half(lamp_studio().surface.mesh(), up_, -20)};
};

TEST_F(Tissue, OneColorHasNoHueAndTwoHaveTwo) {
  const int side = camera_.intrinsics.width;
  Rgb8Image photo(side, side);
  const auto paint = [&](auto color) {
    for (int y = 0; y < side; ++y)
      for (int x = 0; x < side; ++x) {
        const Eigen::Vector3i c = color(x, y);
        for (int i = 0; i < 3; ++i) photo.at(x, y)[i] = static_cast<std::uint8_t>(c[i]);
      }
  };
  const ShadingBasis basis({}, 200);
  const auto numbers = [&] {
    const PhotoLevel level = photo_pyramid(photo, {}, camera_.intrinsics, 256, 256).front();
    Prediction p;
    predict(surface_, level, object_pose(camera_.camera_from_world, surface_.center()), 1, basis,
            basis.first_weights(), {.margin = 8}, p);
    return hue_numbers(level, log_hues(photo, level), p, overlap(level, p, 5));
  };
  const auto spread = [](const std::vector<TissueLight::Hues>& hues) {
    double sum = 0;
    for (const auto& h : hues) sum += h.head<2>().squaredNorm() / static_cast<double>(hues.size());
    return std::sqrt(sum);
  };
  paint([](int x, int) { return Eigen::Vector3i(160 + x % 3, 70, 60); });
  EXPECT_LT(spread(numbers()), 0.3) << "a level or two of noise";
  paint([](int x, int) {
    return x % 32 < 16 ? Eigen::Vector3i(160, 70, 60) : Eigen::Vector3i(200, 170, 100);
  });
  EXPECT_GT(spread(numbers()), 1.0) << "liver and fat";
}

// Texture, highlights and a vignette: under a model of white skin these starts end up to tens of
// millimetres away.
TEST_F(Tissue, ATexturedPieceFindsItsPlace) {
  Sensor sensor;
  sensor.gain = 0.9;
  sensor.offset = 0.01;
  sensor.noise = 0.01;
  sensor.vignette = 0.4;
  PhotoToRegister photo = lamp_studio().photo(lamp_studio().textured, sensor);
  constexpr double kPiece_mm = 1.5;  // a pixel and a half of this small photograph
  photo.start = disturbed(surface_, camera_.camera_from_world, 10, 8, 3);
  const auto found = register_photo(surface_, photo, {});
  EXPECT_LT(mtre_mm(surface_, camera_.camera_from_world, found.camera.camera_from_world), kPiece_mm)
      << found.quality.reason;
}

TEST_F(Tissue, OutOfThePictureIsSaid) {
  PhotoToRegister photo = lamp_studio().photo(lamp_studio().textured);
  photo.start = camera_.camera_from_world;
  photo.start->translation.x() += 2000;
  const auto found = register_photo(surface_, photo, {});
  EXPECT_EQ(found.quality.verdict, Verdict::failed);
  EXPECT_NE(found.quality.reason.find("out of the picture"), std::string::npos)
      << found.quality.reason;
}

}  // namespace
}  // namespace organbake
