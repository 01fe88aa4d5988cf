// SPDX-License-Identifier: GPL-3.0-or-later
#include "cut_sides.h"

#include <gmock/gmock.h>

#include <cmath>

#include "organbake/isosurface/label_surface.h"
#include "shape_volumes.h"

namespace organbake {
namespace {

using ::testing::HasSubstr;

constexpr double kRadius = 20;

// The lower half of a ball, to z = 0 or so: the section is a disc of its radius.
Volume half_grid(const Eigen::Vector3d& spacing) {
  Volume grid = grid_around_origin(spacing, 56);
  grid.size[2] = static_cast<int>(std::lround(-grid.origin_mm.z() / spacing.z())) + 1;
  return grid;
}

std::string warned(const std::function<void(const RunContext&)>& run) {
  std::string told;
  run(RunContext(
      [&](LogLevel level, std::string_view text) {
        if (level == LogLevel::warning) told += text;
      },
      {}, nullptr));
  return told;
}

TEST(CutSides, AreSaidWithTheirArea) {
  const Volume mask = mask_of(ball({0, 0, 0}, kRadius), half_grid({1, 1, 2}));
  Isosurface surface;
  EXPECT_THAT(warned([&](const RunContext& context) {
                surface = extract_label_surface(mask, {}, context);
              }),
              HasSubstr("reaches the volume's end over 12.6 cm²: there the surface is cut flat"));
  EXPECT_NEAR(surface.cut_area_mm2 / (M_PI * kRadius * kRadius), 1, 0.02);
  // A scan that goes on does not cut; one that ends there does.
  const Volume longer = grid_around_origin({1, 1, 2}, 70);
  EXPECT_EQ(extract_label_surface(mask, {}, {}, &longer).cut_area_mm2, 0);
  EXPECT_NEAR(extract_label_surface(mask, {}, {}, &mask).cut_area_mm2, surface.cut_area_mm2, 1e-6);
  Volume around = mask;
  around.ends_with_label = true;
  EXPECT_EQ(extract_label_surface(around, {}).cut_area_mm2, 0);
}

// A disc's dome of half a hemisphere's height holds half a hemisphere's volume.
double domed_volume() { return 0.5 * sphere_volume(kRadius) + 0.25 * sphere_volume(kRadius); }

TEST(CutSides, OfAMaskAreClosedRound) {
  IsosurfaceOptions options;
  options.cap = SurfaceCap::round;
  for (const double up : {1.0, -1.0}) {
    Volume grid = half_grid({1, 1, 1});
    if (up < 0) grid.direction = -grid.direction, grid.origin_mm = -grid.origin_mm;
    const Volume mask = mask_of(ball({0, 0, 0}, kRadius), grid);
    const Isosurface surface = extract_label_surface(mask, options);
    expect_closed_and_sound(surface.mesh);
    EXPECT_NEAR(signed_volume(surface.mesh) / domed_volume(), 1, 0.04);
    EXPECT_NEAR(surface.cut_area_mm2 / (M_PI * kRadius * kRadius), 1, 0.02);
    const Bounds box = bounds(surface.mesh);
    EXPECT_NEAR(up > 0 ? box.max.z() : -box.min.z(), kRadius / 2, 1.2);
  }
}

TEST(CutSides, OfACtAreClosedRound) {
  IsosurfaceOptions options;
  options.cap = SurfaceCap::round;
  options.iso_hu = kScanIso_hu;
  const Volume ct = scan_of(ball({0, 0, 0}, kRadius), half_grid({1, 1, 1}));
  const Isosurface surface = extract_isosurface(ct, options);
  expect_closed_and_sound(surface.mesh);
  EXPECT_NEAR(signed_volume(surface.mesh) / domed_volume(), 1, 0.04);
  EXPECT_NEAR(bounds(surface.mesh).max.z(), kRadius / 2, 1.2);
  EXPECT_NEAR(surface.cut_area_mm2 / (M_PI * kRadius * kRadius), 1, 0.02);
}

TEST(CutSides, SeveralAtOnceAreClosed) {
  Volume grid = half_grid({1, 1, 1});
  grid.size[0] = grid.size[2];
  IsosurfaceOptions options;
  options.cap = SurfaceCap::round;
  const TriangleMesh mesh =
      extract_label_surface(mask_of(ball({0, 0, 0}, kRadius), grid), options).mesh;
  expect_closed_and_sound(mesh);
  // Each side cuts half a disc, into which a circle of half the radius fits.
  EXPECT_GT(bounds(mesh).max.x(), kRadius / 4);
  EXPECT_GT(bounds(mesh).max.z(), kRadius / 4);
}

TEST(LeftOut, IsSaidAndAboveATenthIsAWarning) {
  const Shape kidneys = [](const Eigen::Vector3d& at) {
    return std::max(ball({-14, 0, 0}, 10)(at), ball({14, 0, 0}, 9)(at));
  };
  const Volume mask = mask_of(kidneys, grid_around_origin({1, 1, 1}, 60));
  Isosurface surface;
  EXPECT_THAT(warned([&](const RunContext& context) {
                surface = extract_label_surface(mask, {}, context);
              }),
              HasSubstr("1 of 2 pieces of the surface were kept: 42"));
  EXPECT_NEAR(surface.left_out_share, 729.0 / 1729, 0.01);
  IsosurfaceOptions all;
  all.largest = 0;
  EXPECT_EQ(warned([&](const RunContext& context) {
              surface = extract_label_surface(mask, all, context);
            }),
            "");
  EXPECT_EQ(surface.left_out_share, 0);
}

TEST(KeepVolume, OffGivesTheLevelOfTextbooks) {
  // A single voxel: at one half an octahedron of a sixth of its volume.
  Volume mask = grid_around_origin({1, 1, 1}, 10);
  mask.voxels.assign(static_cast<std::size_t>(mask.size[0]) * mask.size[1] * mask.size[2], 0);
  mask.voxels[mask.voxels.size() / 2] = 1;
  IsosurfaceOptions options;
  options.smooth_mm = 0;
  options.keep_volume = false;
  EXPECT_NEAR(signed_volume(extract_label_surface(mask, options).mesh), 1.0 / 6, 1e-3);
}

}  // namespace
}  // namespace organbake
