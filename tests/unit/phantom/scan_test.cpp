// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/isosurface/isosurface.h"
#include "organbake/phantom/phantom.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

OrganPhantomOptions small_scan() {
  OrganPhantomOptions options;
  options.ct_size = {64, 64, 48};
  options.spacing_mm = {2, 2, 3};
  return options;
}

TEST(Scan, HasTheGridAskedForAwayFromTheOrigin) {
  const OrganPhantomOptions options = small_scan();
  const Volume ct = OrganPhantom(options).scan();
  EXPECT_EQ(ct.size, options.ct_size);
  EXPECT_EQ(ct.spacing_mm, options.spacing_mm);
  EXPECT_EQ(ct.direction, Eigen::Matrix3d::Identity());
  EXPECT_EQ(ct.voxels.size(), 64u * 64 * 48);
  const Vector3d center = ct.world_from_index(Vector3d(31.5, 31.5, 23.5));
  EXPECT_GT(center.cwiseAbs().minCoeff(), 5) << "a lost origin must show in every axis";
  EXPECT_LT(center.norm(), 50);
}

TEST(Scan, IsWaterBesideAirWithoutNoise) {
  OrganPhantomOptions options = small_scan();
  options.noise_hu = 0;
  const OrganPhantom phantom(options);
  const Volume ct = phantom.scan();
  const double reach = options.spacing_mm.norm();  // a voxel's diagonal, with slopes up to 2
  for (int k = 0; k < ct.size[2]; ++k)
    for (int j = 0; j < ct.size[1]; ++j)
      for (int i = 0; i < ct.size[0]; ++i) {
        const double inside = phantom.inside(ct.world_from_index(Vector3d(i, j, k)));
        const int hu = ct.at(i, j, k);
        EXPECT_GE(hu, -1000);
        EXPECT_LE(hu, 60);
        if (std::abs(inside) > reach) {
          EXPECT_EQ(hu, inside > 0 ? 60 : -1000);
        }
      }
}

// Against 20 × 20 × 20 points in the voxel.
TEST(Scan, BoundaryVoxelsHoldTheirInsideShare) {
  OrganPhantomOptions options = small_scan();
  options.noise_hu = 0;
  const OrganPhantom phantom(options);
  const Volume ct = phantom.scan();
  constexpr int kPoints = 20;
  double sum2 = 0, worst = 0;
  int tested = 0;
  for (int v = 0; v < static_cast<int>(ct.voxels.size()) && tested < 300; v += 7) {
    if (ct.voxels[v] == 60 || ct.voxels[v] == -1000) continue;
    const Vector3d index(v % 64, v / 64 % 64, v / (64 * 64));
    int inside = 0;
    for (int p = 0; p < kPoints * kPoints * kPoints; ++p) {
      const Vector3d at(p % kPoints, p / kPoints % kPoints, p / (kPoints * kPoints));
      const Vector3d within = (at + Vector3d::Constant(0.5)) / kPoints - Vector3d::Constant(0.5);
      inside += phantom.inside(ct.world_from_index(index + within)) > 0;
    }
    const double share = double(inside) / (kPoints * kPoints * kPoints);
    const double error = (ct.voxels[v] + 1000) / 1060.0 - share;
    sum2 += error * error;
    worst = std::max(worst, std::abs(error));
    ++tested;
  }
  ASSERT_EQ(tested, 300);
  EXPECT_LT(std::sqrt(sum2 / tested), 0.015);
  EXPECT_LT(worst, 0.04);  // a box's ramp is not exactly a cut box's volume
}

TEST(Scan, VolumeIsTheOrgans) {
  OrganPhantomOptions options = small_scan();
  const OrganPhantom phantom(options);
  double inside = 0;
  for (const std::int16_t hu : phantom.scan().voxels) inside += (hu + 1000) / 1060.0;
  const double scanned = inside * options.spacing_mm.prod();
  const double truth = signed_volume(phantom.surface(6));
  EXPECT_NEAR(scanned / truth, 1, 0.002);  // noise of 10 HU over the whole grid, chords of 1 mm
}

TEST(Scan, NoiseHasItsStrengthAndNoPattern) {
  OrganPhantomOptions options = small_scan();
  options.noise_hu = 12;
  const Volume ct = OrganPhantom(options).scan();
  // The first slice is air. Neighbours along and across rows must not know of each other.
  double sum = 0, sum2 = 0, along = 0, across = 0;
  const int count = 64 * 64;
  for (int v = 0; v < count; ++v) {
    const double noise = ct.voxels[v] + 1000;
    sum += noise;
    sum2 += noise * noise;
    along += noise * (ct.voxels[v + 1] + 1000);
    across += noise * (ct.voxels[v + 64] + 1000);
  }
  const double variance = sum2 / count;
  EXPECT_NEAR(sum / count, 0, 4 * 12 / std::sqrt(count));
  EXPECT_NEAR(std::sqrt(variance), 12, 0.6);  // four standard errors of a standard deviation
  EXPECT_NEAR(along / count / variance, 0, 4 / std::sqrt(count));
  EXPECT_NEAR(across / count / variance, 0, 4 / std::sqrt(count));
}

TEST(Scan, SameVoxelsForAnyNumberOfThreads) {
  const OrganPhantomOptions options = small_scan();
  const auto scan_with = [&](std::size_t threads) {
    const ThreadLimit limit(threads);
    return OrganPhantom(options).scan().voxels;
  };
  EXPECT_EQ(scan_with(1), scan_with(4));
}

TEST(Scan, CanBeCancelled) {
  const std::atomic<bool> cancel = true;
  const RunContext context({}, {}, &cancel);
  EXPECT_THROW(OrganPhantom(small_scan()).scan(context), CancelledError);
}

// The paper's phantom scan gave 80,744 faces; ours, on the same grid, must be as hard.
TEST(OrganIsosurface, HasThePapersFaceCountAndIsTheOrgan) {
  constexpr double kPaperFaces = 80744;
  const OrganPhantom phantom(OrganPhantomOptions{});
  IsosurfaceOptions options;
  options.iso_hu = -470;  // half-way between organ and air: where partial volume puts the surface
  const TriangleMesh mesh = extract_isosurface(phantom.scan(), options).mesh;
  EXPECT_NEAR(static_cast<double>(mesh.faces.size()) / kPaperFaces, 1, 0.1);
  const MeshTopology topology = analyse_topology(mesh);
  EXPECT_TRUE(topology.closed_manifold());
  EXPECT_EQ(topology.euler_characteristic, 2) << "one piece, no handles";

  double sum = 0;
  for (const auto& vertex : mesh.vertices) sum += std::abs(phantom.inside(vertex));
  // Slices 3 mm apart and a ramp that is not linear: a tenth of a slice.
  EXPECT_LT(sum / static_cast<double>(mesh.vertices.size()), 0.3);
}

}  // namespace
}  // namespace organbake
