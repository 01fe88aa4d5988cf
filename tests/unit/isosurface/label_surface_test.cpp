// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <cmath>

#include "organbake/core/parallel.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/ply.h"
#include "organbake/isosurface/label_surface.h"
#include "shape_volumes.h"

namespace organbake {
namespace {

using ::testing::HasSubstr;

// extract_label_surface promises a tenth of a per cent.
constexpr double kLabelVolumeTolerance = 0.0011;
// Stairs as they are give 23° and more; see the measurements beside kLeastSigmaInStairs.
constexpr double kSmoothNormals_deg = 6;

double voxel_volume(const Volume& mask, int label = 1) {
  double count = 0;
  for (const std::int16_t v : mask.voxels) count += v == label;
  return count * mask.spacing_mm.prod();
}

TEST(LabelSurface, IsSmoothAndKeepsTheVolumeAtAnySpacing) {
  constexpr double kRadius = 25;
  for (const Eigen::Vector3d& spacing :
       {Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(1, 1, 3), Eigen::Vector3d(3, 3, 3)}) {
    const Volume mask = mask_of(ball({0, 0, 0}, kRadius), grid_around_origin(spacing, 64));
    const TriangleMesh mesh = extract_label_surface(mask, {}).mesh;
    expect_closed_and_sound(mesh);
    EXPECT_NEAR(signed_volume(mesh) / voxel_volume(mask), 1, kLabelVolumeTolerance);
    EXPECT_LT(radial_normal_rms_deg(mesh), kSmoothNormals_deg) << spacing.transpose();
    EXPECT_LT(radius_rms(mesh, kRadius), 0.1 * spacing.maxCoeff());
  }
}

TEST(LabelSurface, KeepsTheCavityOfAHollowOrgan) {
  const Shape wall = [](const Eigen::Vector3d& at) {
    return std::min(25 - at.norm(), at.norm() - 19);
  };
  const Volume mask = mask_of(wall, grid_around_origin({1, 1, 1}, 60));
  const Isosurface surface = extract_label_surface(mask, {});
  expect_closed_and_sound(surface.mesh);
  EXPECT_EQ(surface.components_found, 1u);
  EXPECT_EQ(surface.left_out_share, 0);
  EXPECT_NEAR(signed_volume(surface.mesh) / voxel_volume(mask), 1, kLabelVolumeTolerance);
}

TEST(LabelSurface, LooksOutwardAndIsNeverMirrored) {
  const Shape organ = asymmetric_organ();
  const Eigen::Vector3d truth =
      centroid(extract_label_surface(mask_of(organ, grid_around_origin({1, 1, 1}, 56)), {}).mesh);
  constexpr double kCentroidTolerance_mm = 0.15;  // a seventh of a voxel
  for (const Eigen::Matrix3d& direction : all_directions()) {
    const Volume mask = mask_of(organ, grid_around_origin({1, 1, 1}, 60, direction));
    const TriangleMesh mesh = extract_label_surface(mask, {}).mesh;
    expect_closed_and_sound(mesh);
    EXPECT_LT((centroid(mesh) - truth).norm(), kCentroidTolerance_mm);
  }
}

TEST(LabelSurface, ThinPartsSurviveTheSmoothing) {
  // A vessel of 1.5 mm radius: at level 0.5 a blur of 2 mm would leave nothing of it.
  const Shape vessel = [](const Eigen::Vector3d& at) {
    return 1.5 - Eigen::Vector2d(at.x(), at.y()).norm();
  };
  const Volume mask = mask_of(vessel, grid_around_origin({1, 1, 1}, 30));
  IsosurfaceOptions options;
  options.smooth_mm = 2;
  const TriangleMesh mesh = extract_label_surface(mask, options).mesh;
  expect_closed_and_sound(mesh);
  EXPECT_NEAR(signed_volume(mesh) / voxel_volume(mask), 1, kLabelVolumeTolerance);
}

TEST(LabelSurface, IsCutFlatWhereTheMaskMeetsTheBorder) {
  Volume grid = grid_around_origin({1, 1, 1}, 64);
  grid.size[2] = 33;
  const Volume mask = mask_of(ball({0, 0, 0}, 25), grid);
  const TriangleMesh mesh = extract_label_surface(mask, {}).mesh;
  expect_closed_and_sound(mesh);
  EXPECT_NEAR(signed_volume(mesh) / voxel_volume(mask), 1, kLabelVolumeTolerance);
  constexpr double kLevelShift_mm = 0.2;  // the level that keeps the volume moves the cap a little
  EXPECT_NEAR(bounds(mesh).max.z(), mask.world_from_index({0, 0, 32.5}).z(), kLevelShift_mm);
}

TEST(LabelSurface, WithoutACapItEndsOpenAtTheBorder) {
  Volume grid = grid_around_origin({1, 1, 1}, 64);
  grid.size[2] = 33;
  IsosurfaceOptions options;
  options.cap = SurfaceCap::open;
  const TriangleMesh mesh = extract_label_surface(mask_of(ball({0, 0, 0}, 25), grid), options).mesh;
  EXPECT_GT(analyse_topology(mesh).boundary_edges, 0u);
  EXPECT_NEAR(bounds(mesh).max.z(), grid.world_from_index({0, 0, 32}).z(), 1e-4);
}

TEST(LabelSurface, SmoothingOfZeroGivesTheVoxelsThemselves) {
  const Volume mask = mask_of(ball({0, 0, 0}, 25), grid_around_origin({1, 1, 1}, 64));
  IsosurfaceOptions options;
  options.smooth_mm = 0;
  const TriangleMesh mesh = extract_label_surface(mask, options).mesh;
  expect_closed_and_sound(mesh);
  EXPECT_GT(radial_normal_rms_deg(mesh), 15);
  EXPECT_NEAR(signed_volume(mesh) / voxel_volume(mask), 1, kLabelVolumeTolerance);
}

TEST(LabelSurface, UnsmoothedSpecksKeepTheirVolume) {
  Volume mask = grid_around_origin({1, 1, 2}, 20);
  mask.voxels.assign(static_cast<std::size_t>(mask.size[0]) * mask.size[1] * mask.size[2], 0);
  for (std::size_t v = 0; v < mask.voxels.size(); v += 211) mask.voxels[v] = 1;
  IsosurfaceOptions options;
  options.smooth_mm = 0;
  options.largest = 0;
  const TriangleMesh mesh = extract_label_surface(mask, options).mesh;
  expect_closed_and_sound(mesh);
  EXPECT_NEAR(signed_volume(mesh) / voxel_volume(mask), 1, kLabelVolumeTolerance);
}

TEST(LabelSurface, TakesOneLabelOfMany) {
  Volume mask = mask_of(ball({-10, 0, 0}, 8), grid_around_origin({1, 1, 1}, 50), 5);
  const Volume other = mask_of(ball({8, 0, 0}, 10), grid_around_origin({1, 1, 1}, 50), 7);
  for (std::size_t v = 0; v < mask.voxels.size(); ++v) {
    if (other.voxels[v]) mask.voxels[v] = 7;
  }
  IsosurfaceOptions options;
  options.label = 5;
  const TriangleMesh mesh = extract_label_surface(mask, options).mesh;
  EXPECT_NEAR(signed_volume(mesh) / voxel_volume(mask, 5), 1, kLabelVolumeTolerance);
  options.label = 6;
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { extract_label_surface(mask, options); }),
              HasSubstr("the mask has no label 6; it holds 5, 7"));
}

TEST(LabelSurface, SingleVoxelsAndFullMasksAreSurfacesToo) {
  Volume mask = grid_around_origin({1, 1, 1}, 10);
  mask.voxels.assign(static_cast<std::size_t>(mask.size[0]) * mask.size[1] * mask.size[2], 0);
  mask.voxels[mask.voxels.size() / 2] = 1;
  const TriangleMesh speck = extract_label_surface(mask, {}).mesh;
  expect_closed_and_sound(speck);
  EXPECT_NEAR(signed_volume(speck), 1, 0.05);  // eight faces can do no better
  std::fill(mask.voxels.begin(), mask.voxels.end(), std::int16_t{1});
  const TriangleMesh block = extract_label_surface(mask, {}).mesh;
  expect_closed_and_sound(block);
  EXPECT_NEAR(signed_volume(block) / voxel_volume(mask), 1, kLabelVolumeTolerance);
}

TEST(LabelSurface, SpecksFinerThanTheSmoothingAreRefused) {
  Volume mask;
  mask.size = {16, 16, 16};
  // The blur, as high as the stairs, is 370 voxels wide along y.
  mask.spacing_mm = {1.15, 0.17, 80};
  mask.voxels.assign(4096, 0);
  for (int k = 0; k < 10; ++k) mask.voxels[std::size_t(397 * k + 100)] = 1;
  try {
    extract_label_surface(mask, {});
    ADD_FAILURE() << "a surface with another volume than its label";
  } catch (const BadDataError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("finer than its smoothing"));
  }
}

TEST(LabelSurface, EmptyMasksAreRefused) {
  Volume mask = grid_around_origin({1, 1, 1}, 10);
  mask.voxels.assign(static_cast<std::size_t>(mask.size[0]) * mask.size[1] * mask.size[2], 0);
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { extract_label_surface(mask, {}); }),
              HasSubstr("no label 1; it is empty"));
}

TEST(LabelSurface, SmoothingFarBeyondTheVoxelsIsAUsageError) {
  const Volume mask = mask_of(ball({0, 0, 0}, 0.2), grid_around_origin({0.01, 0.01, 0.01}, 0.3));
  IsosurfaceOptions options;
  options.smooth_mm = 5;
  EXPECT_THAT(message_of(ExitCode::usage, [&] { extract_label_surface(mask, options); }),
              HasSubstr("more than 60 voxels"));
}

TEST(LabelSurface, SameBytesForAnyNumberOfThreads) {
  const Volume mask = mask_of(asymmetric_organ(), grid_around_origin({0.8, 0.8, 1.6}, 56));
  std::string first;
  for (const std::size_t threads : {1, 2, 4}) {
    const ThreadLimit limit(threads);
    const std::string bytes = serialise_ply(extract_label_surface(mask, {}).mesh);
    if (first.empty()) first = bytes;
    EXPECT_EQ(bytes, first);
  }
}

}  // namespace
}  // namespace organbake
