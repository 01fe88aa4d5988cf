// SPDX-License-Identifier: Apache-2.0
#include "organbake/player/false_colors.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>

namespace organbake {
namespace {

using Eigen::Vector3d;

// A square of two faces across the z axis, which turns to an eye before it.
MeasuredSurface square() {
  MeasuredSurface surface;
  surface.posed.vertices = {{-10, -10, 0}, {10, -10, 0}, {10, 10, 0}, {-10, 10, 0}};
  surface.posed.faces = {{0, 2, 1}, {0, 3, 2}};
  surface.values = {0, 1, 1, 0};
  return surface;
}

TEST(FalseColors, StrainIsThePrincipalStretchWhicheverWayItPoints) {
  const TriangleMesh mesh = square().posed;
  const auto strained = [&](const Eigen::Matrix3d& by) {
    std::vector<Vector3d> posed;
    for (const Vector3d& v : mesh.vertices) posed.push_back(by * v + Vector3d(1, 2, 3));
    return surface_strain(mesh.faces, mesh.vertices, posed)[0];
  };
  const Eigen::Matrix3d turned =
      Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  const Eigen::Matrix3d aslant = Eigen::AngleAxisd(0.4, Vector3d::UnitZ()).toRotationMatrix();
  EXPECT_NEAR(strained(turned), 0, 1e-9);
  for (const double stretch : {1.25, 0.7}) {
    const Eigen::Matrix3d along = Vector3d(stretch, 1, 1).asDiagonal();
    EXPECT_NEAR(strained(turned * aslant * along * aslant.transpose()), stretch - 1, 1e-9);
  }
}

TEST(FalseColors, DisplacementIsALength) {
  EXPECT_EQ(displacement_mm({{0, 0, 0}, {1, 1, 1}}, {{3, 4, 0}, {1, 1, 1}}),
            (std::vector<double>{5, 0}));
}

TEST(FalseColors, GoFromDarkToBrightAndStayWithinTheirEnds) {
  int before = -1;
  for (int i = 0; i <= 32; ++i) {
    const auto [r, g, b] = false_color(i / 32.0);
    const int grey = 30 * r + 59 * g + 11 * b;
    EXPECT_GT(grey, before);
    before = grey;
  }
  EXPECT_EQ(false_color(-3), false_color(0));
  EXPECT_EQ(false_color(7), false_color(1));
}

TEST(FalseColors, PaintTheSkinAloneByItsNumbers) {
  View view;
  view.camera.intrinsics = {80, 60, 100, 100, 40, 30};
  view.camera.camera_from_world.translation = Vector3d(0, 0, 100);
  Frame frame;
  frame.color = Rgb8Image(80, 60);
  std::fill(frame.color.pixels.begin(), frame.color.pixels.end(), std::uint8_t{110});
  frame.cover.assign(80 * 60, Cover::samples);
  frame.cover[30 * 80 + 41] = Cover::solid;
  const Rgb8Image painted = false_color_picture(frame, view, {square()}, 0, 1);
  const auto pixel = [&](int x, int y) {
    const std::uint8_t* p = painted.at(x, y);
    return std::array<std::uint8_t, 3>{p[0], p[1], p[2]};
  };
  const std::array<std::uint8_t, 3> plain = {110, 110, 110};
  EXPECT_EQ(pixel(2, 2), plain);    // beside the square
  EXPECT_EQ(pixel(41, 30), plain);  // a tool
  for (const int x : {32, 39, 47}) {
    const auto expected = false_color((x + 0.5 - 30) / 20);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(pixel(x, 30)[c], expected[c], 2);
  }
}

}  // namespace
}  // namespace organbake
