// SPDX-License-Identifier: GPL-3.0-or-later
// The surface of a CT: the level, its place between voxels, what is closed and what is refused.
#include "organbake/isosurface/isosurface.h"

#include "organbake/contour/contour.h"
#include "organbake/core/parallel.h"
#include "organbake/core/random.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/ply.h"
#include "organbake/phantom/known_answers.h"
#include "shape_volumes.h"
#include "support/files.h"
#include "support/testing.h"
#include "surface_steps.h"

namespace organbake {
namespace {

using ::testing::HasSubstr;

// Marching cubes cuts corners: on a ball of radius r and voxels h the sagitta is h²/8r = 0.006 mm
// at 1 mm and 0.06 mm at 3 mm; rounding to whole HU adds 0.5/200 mm.
constexpr double kRadiusTolerance_mm = 0.02;
constexpr double kThickRadiusTolerance_mm = 0.08;
constexpr double kVolumeTolerance = 0.005;
constexpr double kCentroidTolerance_mm = 0.05;

IsosurfaceOptions at_edge() {
  IsosurfaceOptions options;
  options.iso_hu = kScanIso_hu;
  return options;
}

TEST(Isosurface, DefaultsAreValidAndBoundsAreChecked) {
  EXPECT_NO_THROW(IsosurfaceOptions().check());
  const auto spoiled = [](auto spoil) {
    IsosurfaceOptions options;
    spoil(options);
    return message_of(ExitCode::usage, [&] { options.check(); });
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(spoiled([&](auto& o) { o.iso_hu = nan; }), HasSubstr("iso_hu"));
  EXPECT_THAT(spoiled([](auto& o) { o.smooth_mm = -1; }), HasSubstr("smooth_mm is -1"));
  EXPECT_THAT(spoiled([](auto& o) { o.smooth_mm = 21; }), HasSubstr("0…20 mm"));
  EXPECT_THAT(spoiled([&](auto& o) { o.smooth_mm = nan; }), HasSubstr("smooth_mm"));
  EXPECT_THAT(spoiled([](auto& o) { o.min_size_mm = -1; }), HasSubstr("min_size_mm"));
  EXPECT_THAT(spoiled([](auto& o) { o.label = 0; }), HasSubstr("background"));
  EXPECT_THAT(spoiled([](auto& o) { o.label = 16777217; }), HasSubstr("16777216"));
}

TEST(Isosurface, OfABallIsTheBall) {
  constexpr double kRadius = 20;
  const Volume ct = scan_of(ball({0, 0, 0}, kRadius), grid_around_origin({1, 1, 1}, 56));
  const Isosurface surface = extract_isosurface(ct, at_edge());
  expect_closed_and_sound(surface.mesh);
  EXPECT_EQ(surface.components_found, 1u);
  EXPECT_LT(radius_rms(surface.mesh, kRadius), kRadiusTolerance_mm);
  EXPECT_NEAR(signed_volume(surface.mesh) / sphere_volume(kRadius), 1, kVolumeTolerance);
}

TEST(Isosurface, OnThickSlicesStaysABall) {
  constexpr double kRadius = 20;
  const Volume ct =
      scan_of(ball({0, 0, 0}, kRadius), grid_around_origin({0.7, 0.7, 3}, 56, oblique_direction()));
  const Isosurface surface = extract_isosurface(ct, at_edge());
  expect_closed_and_sound(surface.mesh);
  EXPECT_LT(radius_rms(surface.mesh, kRadius), kThickRadiusTolerance_mm);
}

TEST(Isosurface, LooksOutwardAndIsNeverMirrored) {
  const Shape organ = asymmetric_organ();
  const Volume upright = scan_of(organ, grid_around_origin({1, 1, 1}, 56));
  const TriangleMesh truth = extract_isosurface(upright, at_edge()).mesh;
  for (const Eigen::Matrix3d& direction : all_directions()) {
    const Volume ct = scan_of(organ, grid_around_origin({1, 1.2, 0.9}, 60, direction));
    const TriangleMesh mesh = extract_isosurface(ct, at_edge()).mesh;
    expect_closed_and_sound(mesh);
    EXPECT_NEAR(signed_volume(mesh) / signed_volume(truth), 1, kVolumeTolerance);
    EXPECT_LT((centroid(mesh) - centroid(truth)).norm(), kCentroidTolerance_mm);
  }
}

TEST(Isosurface, IsCappedFlatHalfAVoxelBeyondTheLastCentres) {
  // Tissue everywhere, so the surface is the box of the voxels themselves.
  Volume slab =
      scan_of([](const Eigen::Vector3d&) { return 100.0; }, grid_around_origin({1, 2, 3}, 20));
  slab.voxels[slab.voxels.size() / 2] = -1000;  // a bubble, so that the level is inside the data
  const Isosurface surface = extract_isosurface(slab, at_edge());
  expect_closed_and_sound(surface.mesh);
  const Bounds box = bounds(surface.mesh);
  const Eigen::Vector3d half = 0.5 * slab.spacing_mm;
  const Eigen::Vector3d last(slab.size[0] - 1, slab.size[1] - 1, slab.size[2] - 1);
  constexpr double kSinglePrecision_mm = 1e-4;
  EXPECT_LT((box.min - (slab.origin_mm - half)).norm(), kSinglePrecision_mm);
  EXPECT_LT((box.max - (slab.world_from_index(last) + half)).norm(), kSinglePrecision_mm);
}

TEST(Isosurface, AnOrganThatLeavesTheVolumeIsCutThere) {
  constexpr double kRadius = 20;
  Volume grid = grid_around_origin({1, 1, 1}, 56);
  grid.size[2] = 29;  // about half the ball
  const Isosurface surface = extract_isosurface(scan_of(ball({0, 0, 0}, kRadius), grid), at_edge());
  expect_closed_and_sound(surface.mesh);
  const double top = grid.world_from_index({0, 0, 28.5}).z();
  EXPECT_NEAR(bounds(surface.mesh).max.z(), top, 1e-4);
  const double cap = M_PI * std::pow(kRadius - top, 2) * (3 * kRadius - (kRadius - top)) / 3;
  EXPECT_NEAR(signed_volume(surface.mesh) / (sphere_volume(kRadius) - cap), 1, kVolumeTolerance);
}

TEST(Isosurface, WithoutACapItStaysOpen) {
  Volume grid = grid_around_origin({1, 1, 1}, 56);
  grid.size[2] = 29;
  IsosurfaceOptions options = at_edge();
  options.cap = SurfaceCap::open;
  const Isosurface surface = extract_isosurface(scan_of(ball({0, 0, 0}, 20), grid), options);
  const MeshTopology topology = analyse_topology(surface.mesh);
  EXPECT_GT(topology.boundary_edges, 0u);
  EXPECT_EQ(topology.non_manifold_edges, 0u);
}

TEST(Isosurface, LevelsOnVoxelValuesGiveNoDegenerateFaces) {
  // Whole numbers everywhere and a level that many voxels have exactly.
  Volume ct = grid_around_origin({1, 1, 1}, 30);
  for (int i = 0; i < ct.size[0] * ct.size[1] * ct.size[2]; ++i) {
    const int x = i % ct.size[0], y = i / ct.size[0] % ct.size[1], z = i / ct.size[0] / ct.size[1];
    ct.voxels.push_back(
        static_cast<std::int16_t>(40 - std::abs(x - 15) - std::abs(y - 15) - std::abs(z - 15)));
  }
  IsosurfaceOptions options;
  options.iso_hu = 30;
  expect_closed_and_sound(extract_isosurface(ct, options).mesh);
}

TEST(Isosurface, OfNoiseIsStillClosed) {
  // Every case of marching cubes, ambiguous faces included, over the whole range of int16.
  for (const int reach : {1, 100, 32000}) {
    RandomStream random(7, static_cast<std::uint64_t>(reach));
    Volume noise = grid_around_origin({1, 1, 2.5}, 30);
    for (int i = 0; i < noise.size[0] * noise.size[1] * noise.size[2]; ++i)
      noise.voxels.push_back(static_cast<std::int16_t>(std::lround(random.uniform(-reach, reach))));
    IsosurfaceOptions options;
    options.iso_hu = 0;
    options.largest = 0;
    expect_closed_and_sound(extract_isosurface(noise, options).mesh);
  }
}

TEST(Isosurface, ExtremeValuesDoNotOverflow) {
  Volume ct = grid_around_origin({1, 1, 1}, 20);
  const std::size_t count = static_cast<std::size_t>(ct.size[0]) * ct.size[1] * ct.size[2];
  for (std::size_t i = 0; i < count; ++i) ct.voxels.push_back(i % 7 < 3 ? -32768 : 32767);
  for (const double iso : {-32767.5, 0.0, 32767.0}) {
    IsosurfaceOptions options;
    options.iso_hu = iso;
    expect_closed_and_sound(extract_isosurface(ct, options).mesh);
  }
}

TEST(Isosurface, KeepsTheLargestPieces) {
  const Shape balls = [](const Eigen::Vector3d& at) {
    return std::max({ball({-14, 0, 0}, 9)(at), ball({9, 0, 0}, 7)(at), ball({22, 0, 0}, 3)(at)});
  };
  const Volume ct = scan_of(balls, grid_around_origin({1, 1, 1}, 60));
  const auto kept = [&](std::size_t count) {
    IsosurfaceOptions options = at_edge();
    options.largest = count;
    return extract_isosurface(ct, options);
  };
  EXPECT_EQ(kept(0).components_kept, 3u);
  EXPECT_NEAR(signed_volume(kept(1).mesh) / sphere_volume(9), 1, 0.02);
  EXPECT_NEAR(signed_volume(kept(2).mesh) / (sphere_volume(9) + sphere_volume(7)), 1, 0.02);
  EXPECT_EQ(kept(2).components_found, 3u);
  EXPECT_EQ(kept(50).components_kept, 3u);
}

TEST(Isosurface, ACavityWithMoreAreaThanTheSkinIsNotTheOrgan) {
  // A body of 24 mm with crinkled lungs: an air-filled shell whose walls have more area.
  const Shape body = [](const Eigen::Vector3d& at) {
    const double folds = 3 * std::sin(at.x()) * std::sin(at.y()) * std::sin(at.z());
    return std::min(24 - at.norm(), at.norm() - 17 - folds);
  };
  const Volume ct = scan_of(body, grid_around_origin({0.8, 0.8, 0.8}, 60));
  const TriangleMesh mesh = extract_isosurface(ct, at_edge()).mesh;
  EXPECT_NEAR(signed_volume(mesh) / sphere_volume(24), 1, kVolumeTolerance);
}

TEST(Isosurface, RefusesLevelsOutsideTheDataNamingTheRange) {
  Volume ct = scan_of(ball({0, 0, 0}, 8), grid_around_origin({1, 1, 1}, 24));
  ct.voxels[0] = -1024;
  ct.voxels[1] = 1650;
  for (const double iso : {-2000.0, -1024.0, 1651.0, 1e9}) {
    IsosurfaceOptions options;
    options.iso_hu = iso;
    EXPECT_THAT(message_of(ExitCode::bad_data, [&] { extract_isosurface(ct, options); }),
                HasSubstr("the volume spans −1024…1650; choose --iso inside it"));
  }
  std::fill(ct.voxels.begin(), ct.voxels.end(), std::int16_t{40});
  message_of(ExitCode::bad_data, [&] { extract_isosurface(ct, {}); });
}

TEST(Isosurface, OneVoxelThinVolumesAreSlabsOrRefused) {
  Volume slice = grid_around_origin({1, 1, 1}, 24);
  slice.size[2] = 1;
  const Volume ct = scan_of(ball({0, 0, -12}, 15), slice);
  expect_closed_and_sound(extract_isosurface(ct, at_edge()).mesh);
  IsosurfaceOptions open = at_edge();
  open.cap = SurfaceCap::open;
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { extract_isosurface(ct, open); }),
              HasSubstr("no surface at −450"));
}

TEST(Isosurface, RefusesABrokenVolume) {
  Volume ct = scan_of(ball({0, 0, 0}, 8), grid_around_origin({1, 1, 1}, 24));
  ct.voxels.pop_back();
  message_of(ExitCode::bad_data, [&] { extract_isosurface(ct, {}); });
  message_of(ExitCode::bad_data, [&] { extract_isosurface(Volume(), {}); });
}

TEST(Isosurface, SameBytesForAnyNumberOfThreads) {
  const Volume ct = scan_of(asymmetric_organ(), grid_around_origin({0.6, 0.6, 0.6}, 56));
  std::string first;
  for (const std::size_t threads : {1, 2, 4}) {
    const ThreadLimit limit(threads);
    const std::string bytes = serialise_ply(extract_isosurface(ct, at_edge()).mesh);
    if (first.empty()) first = bytes;
    EXPECT_EQ(bytes, first);
  }
}

TEST(Isosurface, CanBeCancelled) {
  const std::atomic<bool> cancel = true;
  const RunContext context({}, {}, &cancel);
  const Volume ct = scan_of(ball({0, 0, 0}, 8), grid_around_origin({1, 1, 1}, 24));
  EXPECT_THROW(extract_isosurface(ct, at_edge(), context), CancelledError);
}

TEST(ProposedLevel, LiesHalfWayBetweenAirAndTissue) {
  RandomStream random(3);
  Volume ct = scan_of(ball({0, 0, 0}, 15), grid_around_origin({1, 1, 1}, 50));
  for (std::int16_t& value : ct.voxels)
    value = static_cast<std::int16_t>(value + std::lround(20 * random.normal()));
  ct.voxels[7] = 3000;  // a clip of metal
  const ProposedLevel proposed = propose_level(ct);
  constexpr double kPeakWidth_hu = 10;  // of 20 HU of noise
  EXPECT_NEAR(proposed.low_peak_hu, -1000, kPeakWidth_hu);
  EXPECT_NEAR(proposed.high_peak_hu, 100, kPeakWidth_hu);
  EXPECT_NEAR(proposed.level_hu, -450, kPeakWidth_hu);
  EXPECT_THAT(proposed.reason(), ::testing::HasSubstr("half-way between the peaks at −"));
}

TEST(ProposedLevel, NeedsTwoValues) {
  Volume ct;
  ct.size = {2, 2, 2};
  ct.voxels.assign(8, 40);
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { propose_level(ct); }),
              ::testing::HasSubstr("no level to propose"));
}

TEST(ProposedLevel, IsTakenAndTold) {
  std::string told;
  const RunContext context([&](LogLevel, std::string_view text) { told += text; }, {}, nullptr);
  const Volume ct = scan_of(ball({0, 0, 0}, 15), grid_around_origin({1, 1, 1}, 50));
  IsosurfaceOptions options;
  options.iso_hu = std::nullopt;
  const Isosurface surface = extract_isosurface(ct, options, context);
  EXPECT_NEAR(surface.level_hu, -450, 1);
  EXPECT_THAT(told, ::testing::HasSubstr("level −450, half-way between the peaks"));
  constexpr double kRadiusTolerance_mm = 0.02;  // as in isosurface_test
  EXPECT_LT(radius_rms(surface.mesh, 15), kRadiusTolerance_mm);
}

TriangleMesh surface_of(const Volume& ct, bool refine) {
  IsosurfaceOptions options;
  options.iso_hu = kBallHalfWay_hu;
  options.refine = refine;
  return extract_isosurface(ct, options).mesh;
}

// RMS radial error (mm), over all edges of the grid, of where the straight line between two voxels
// crosses the half-way level: what marching cubes reaches when it does nothing wrong.
double linear_crossing_rms_mm(const Volume& ball, double radius_mm) {
  double squares = 0;
  std::size_t count = 0;
  const std::array<int, 3> cells = {ball.size[0] - 1, ball.size[1] - 1, ball.size[2] - 1};
  for_each_voxel(cells, [&](int i, int j, int k) {
    for (int axis = 0; axis < 3; ++axis) {
      Eigen::Vector3i next(i, j, k);
      ++next[axis];
      const double here = ball.at(i, j, k), there = ball.at(next.x(), next.y(), next.z());
      if ((here >= kBallHalfWay_hu) == (there >= kBallHalfWay_hu)) continue;
      Eigen::Vector3d index(i, j, k);
      index[axis] += (kBallHalfWay_hu - here) / (there - here);
      const double miss = ball.world_from_index(index).norm() - radius_mm;
      squares += miss * miss;
      ++count;
    }
  });
  return std::sqrt(squares / static_cast<double>(count));
}

TEST(RefineCrossings, PutsABallInThickSlicesInItsPlace) {
  constexpr double kRadius = 20;
  const Volume ct = scan_ball(kRadius, {0.7, 0.7, 3});
  const double linear = linear_crossing_rms_mm(ct, kRadius);
  EXPECT_GT(linear, 0.1);  // plain marching cubes: about 0.11 mm
  EXPECT_LE(radius_rms(surface_of(ct, false), kRadius), 1.02 * linear);
  const TriangleMesh refined = surface_of(ct, true);
  expect_closed_and_sound(refined);
  EXPECT_LE(radius_rms(refined, kRadius), 0.05);
}

// One row of voxels along z, repeated: the refined height of the surface between tissue and air.
double refined_height(const std::vector<std::int16_t>& column, double level) {
  Volume ct;
  ct.size = {2, 2, static_cast<int>(column.size())};
  for (const std::int16_t value : column) ct.voxels.insert(ct.voxels.end(), 4, value);
  TriangleMesh mesh = contour(std::span<const std::int16_t>(ct.voxels), ct.size, level);
  refine_crossings(mesh, ct, level);
  return mesh.vertices.front().z();
}

TEST(RefineCrossings, KnowsHowFullAVoxelIs) {
  constexpr double kExact = 1e-6;
  // Voxel 2 is full up to its share; its lower side lies at 1.5.
  for (const std::int16_t share : {60, 70, 90}) {
    EXPECT_NEAR(refined_height({100, 100, share, 0, 0}, 50), 1.5 + share / 100.0, kExact);
    EXPECT_NEAR(refined_height({0, 0, share, 100, 100}, 50), 2.5 - share / 100.0, kExact);
  }
  // Blurred alike to both sides, the edge stays where it was.
  EXPECT_NEAR(refined_height({100, 100, 80, 20, 0, 0}, 50), 2.5, kExact);
  // A level that is not half-way lies towards its own plateau: a voxel's ramp, 0.1 of it.
  EXPECT_NEAR(refined_height({100, 100, 70, 0, 0}, 60), 1.5 + 0.7 - 0.1, kExact);
}

TEST(RefineCrossings, LeavesWhatHasNoPlateaus) {
  const auto unrefined = [](double below, double above, double at) {
    return at + (below - 50) / (below - above);
  };
  constexpr double kSingle = 1e-6;
  // A wall thinner than a voxel, and a long slope.
  EXPECT_NEAR(refined_height({0, 60, 0, 0}, 50), unrefined(0, 60, 0), kSingle);
  std::vector<std::int16_t> slope;
  for (int i = 0; i < 14; ++i) slope.push_back(static_cast<std::int16_t>(113 - 9 * i));
  const int last_above = 7;
  EXPECT_NEAR(refined_height(slope, 49.5),
              last_above + (slope[7] - 49.5) / double(slope[7] - slope[8]) - 1 + 1, kSingle);
}

}  // namespace
}  // namespace organbake
