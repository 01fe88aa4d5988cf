// SPDX-License-Identifier: GPL-3.0-or-later
#include "moving_scene.h"

#include "support/testing.h"
#include "tissue_of_tests.h"

namespace organbake {
namespace {

// The point of the surface at rest that a breath has brought to x, y.
Eigen::Vector3d rest_point(double x, double y, double excursion) {
  const TissueRelief::Breathed moved = relief().at(x, y, excursion);
  return {moved.rest_x_mm, moved.rest_y_mm, relief().at(moved.rest_x_mm, moved.rest_y_mm).z_mm};
}

TEST(TissueRelief, SlopesAreTheHeightsOwn) {
  constexpr double kStep = 1e-3;
  for (const double excursion : {0.0, 3.0, 12.0})
    for (double x = -50.1; x < 60; x += 7.3)
      for (double y = -40.2; y < 40; y += 6.1) {
        const auto z = [&](double dx, double dy) {
          return relief().at(x + dx, y + dy, excursion).height.z_mm;
        };
        const TissueRelief::Height here = relief().at(x, y, excursion).height;
        // Float nodes carry 4e-6 mm, and the step has its share of curvature.
        EXPECT_NEAR(here.slope_x, (z(kStep, 0) - z(-kStep, 0)) / (2 * kStep), 1e-3);
        EXPECT_NEAR(here.slope_y, (z(0, kStep) - z(0, -kStep)) / (2 * kStep), 1e-3);
      }
}

TEST(TissueRelief, ABreathPushesTheLiverFartherThanTheFat) {
  constexpr double kExcursion = 3;
  const auto pushed = [&](double x, double y) {
    const double now = relief().at(x, y, kExcursion).height.z_mm;
    return (Eigen::Vector3d(x, y, now) - rest_point(x, y, kExcursion)).norm();
  };
  EXPECT_NEAR(pushed(-20, -45), kExcursion, 1e-6);
  EXPECT_NEAR(pushed(-20, 60), 0.35 * kExcursion, 1e-6);
  EXPECT_LT(pushed(-20, 20), pushed(-20, 0));
  EXPECT_EQ(rest_point(10, 10, 0), Eigen::Vector3d(10, 10, relief().at(10, 10).z_mm));
}

TEST(TissueRelief, TissuesAddUpAndAllThreeAreThere) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (double x = -50; x <= 50; x += 1)
    for (double y = -35; y <= 35; y += 1) {
      const Eigen::Vector3d share = relief().tissues(x, y);
      EXPECT_NEAR(share.sum(), 1, 1e-12);
      EXPECT_GE(share.minCoeff(), 0);
      sum += share;
    }
  EXPECT_GT(sum.minCoeff(), 0.03 * sum.sum());
}

TEST(TissueRelief, TheMeshLiesOnItAndLooksAtTheScope) {
  const TriangleMesh mesh = relief().surface(2);
  for (std::size_t i = 0; i < mesh.vertices.size(); i += 97) {
    const Eigen::Vector3d& v = mesh.vertices[i];
    EXPECT_EQ(v.z(), relief().at(v.x(), v.y()).z_mm);
  }
  for (std::size_t f = 0; f < mesh.faces.size(); f += 53) EXPECT_LT(face_normal(mesh, f).z(), 0);
}

const TissueSkin& mottled() {
  static const TissueSkin skin(relief(), 1, 0.1);
  return skin;
}

// Standard deviation of the logarithm of red along rows of liver, of differences so far apart.
double contrast(const TissueSkin& skin, double apart_mm) {
  double squares = 0, count = 0;
  for (double y = -30; y < -18; y += 0.31)
    for (double x = -45; x < -10; x += 0.17, ++count)
      squares +=
          std::pow(std::log(skin.at(x + apart_mm, y).albedo.x() / skin.at(x, y).albedo.x()), 2);
  return std::sqrt(squares / count / 2);
}

TEST(TissueSkin, IsMottledAtAllSizes) {
  const TissueSkin& skin = mottled();
  EXPECT_GT(contrast(skin, 0.3), 0.03);
  EXPECT_GT(contrast(skin, 1), 1.2 * contrast(skin, 0.3));
  EXPECT_GT(contrast(skin, 5), 1.1 * contrast(skin, 1));
  EXPECT_LT(contrast(skin, 5), 0.3);
}

TEST(TissueSkin, WithoutMottlingATissueIsOfOneColour) {
  const TissueSkin skin(relief(), 1, 0);
  EXPECT_LT(contrast(skin, 5), 1e-3);
}

}  // namespace
}  // namespace organbake
