// SPDX-License-Identifier: GPL-3.0-or-later

#include <Eigen/LU>
#include <bit>

#include "organbake/core/error.h"
#include "organbake/core/random.h"
#include "organbake/viewpoints/placement.h"
#include "placing.h"
#include "support/meshes.h"
#include "support/testing.h"

namespace organbake {
namespace {

constexpr double kPixelRounding = 1e-9;  // 512 pixels, a dozen operations in double

TEST(PlacementOptions, DefaultsAreValid) { EXPECT_NO_THROW(PlacementOptions{}.check()); }

TEST(PlacementOptions, BoundsAreChecked) {
  const auto refused = [](const std::function<void(PlacementOptions&)>& change) {
    PlacementOptions options;
    options.cone = ViewingCone{};
    change(options);
    EXPECT_THROW(options.check(), UsageError);
  };
  refused([](auto& o) { o.count = 0; });
  refused([](auto& o) { o.count = 257; });
  refused([](auto& o) { o.map_size = 7; });
  refused([](auto& o) { o.map_size = 16385; });
  refused([](auto& o) { o.field_of_view_rad = 0; });
  refused([](auto& o) { o.field_of_view_rad = std::numeric_limits<double>::quiet_NaN(); });
  refused([](auto& o) { o.margin = -0.01; });
  refused([](auto& o) { o.margin = 0.5; });
  refused([](auto& o) { o.cone->half_angle_rad = 0; });
  refused([](auto& o) { o.cone->half_angle_rad = 2; });
  refused([](auto& o) { o.cone->axis.setZero(); });
  refused([](auto& o) { o.cone->axis.x() = std::numeric_limits<double>::infinity(); });
}

// Every vertex inside every map, off the border by the margin, and the map filled up to it.
void expect_maps_hold_the_organ(const TriangleMesh& surface, const PlacementOptions& options) {
  const Placement placement = place_cameras(surface, options);
  ASSERT_EQ(std::ssize(placement.cameras), options.count);
  const double distance =
      (placement.cameras[0].center_world_mm() - placement.manifold.center_world_mm).norm();
  for (const PosedCamera& camera : placement.cameras) {
    camera.intrinsics.check();
    EXPECT_EQ(camera.intrinsics.fx, camera.intrinsics.fy);
    EXPECT_EQ(camera.intrinsics.cx, 0.5 * options.map_size);
    EXPECT_EQ(camera.intrinsics.cy, 0.5 * options.map_size);
    const Eigen::Vector3d arm = camera.center_world_mm() - placement.manifold.center_world_mm;
    EXPECT_NEAR(arm.norm(), distance, 1e-9 * distance);
    EXPECT_LT((arm.normalized() + camera.view_direction_world()).norm(), 1e-9);
    double border = options.map_size;  // least distance of any vertex from the map's border
    for (const Eigen::Vector3d& vertex : surface.vertices) {
      ASSERT_GT((camera.camera_from_world * vertex).z(), 0.1 * distance);
      const Eigen::Vector2d pixel = project(camera, vertex);
      border = std::min({border, pixel.x(), pixel.y(), options.map_size - pixel.x(),
                         options.map_size - pixel.y()});
    }
    EXPECT_NEAR(border, options.margin * options.map_size, 1e3 * kPixelRounding);
    // Tightening only narrows the view that was asked for.
    const double half_view = std::atan(0.5 * options.map_size / camera.intrinsics.fx);
    EXPECT_LE(2 * half_view, options.field_of_view_rad + 1e-9);
  }
}

TEST(PlaceCameras, MapsHoldTheOrganAndAreFilled) {
  for (const int count : {1, 2, 3, 4, 6, 8, 20}) {
    SCOPED_TRACE(count);
    PlacementOptions options{.count = count};
    expect_maps_hold_the_organ(lumpy_mesh(50, 3), options);
    options.cone = ViewingCone{.axis = {1, -1, 0.3}, .half_angle_rad = 0.7};
    expect_maps_hold_the_organ(lumpy_mesh(50, 3), options);
  }
}

TEST(PlaceCameras, OddBodiesViewsAndPlaces) {
  expect_maps_hold_the_organ(moved(grid_box({200, 5, 20}, 4), {1e4, -2e4, 3e4}), {.count = 12});
  expect_maps_hold_the_organ(grid_box({1, 1, 1}, 2), {.map_size = 64, .margin = 0.4});
  expect_maps_hold_the_organ(sphere_mesh(30, 2), {.field_of_view_rad = 0.02});
  expect_maps_hold_the_organ(sphere_mesh(30, 2), {.field_of_view_rad = 2.4, .margin = 0});
}

TEST(PlaceCameras, CameraZeroLooksFromTheFrontWithTheHeadUp) {
  const TriangleMesh organ = lumpy_mesh(50, 3);
  const Placement placement = place_cameras(organ, {});
  const PosedCamera& front = placement.cameras[0];
  EXPECT_LT((front.view_direction_world() - Eigen::Vector3d(0, 1, 0)).norm(), 1e-9);
  EXPECT_EQ(front.name, "cam_000");
  EXPECT_EQ(placement.cameras[7].name, "cam_007");
  const Eigen::Vector3d center = placement.manifold.center_world_mm;
  // The patient's left is +x of LPS: seen from the front it is on the right of the picture; the
  // head (+z) is at the top. Not a mirror image.
  const Eigen::Vector2d middle = project(front, center);
  EXPECT_GT(project(front, center + Eigen::Vector3d(10, 0, 0)).x(), middle.x() + 1);
  EXPECT_LT(project(front, center + Eigen::Vector3d(0, 0, 10)).y(), middle.y() - 1);
  for (const PosedCamera& camera : placement.cameras) {
    EXPECT_NEAR(camera.camera_from_world.rotation.determinant(), 1, 1e-12);
    // Up is up in every camera that does not look along it.
    if (std::abs(camera.view_direction_world().z()) > 0.99) continue;
    EXPECT_LT(project(camera, center + Eigen::Vector3d(0, 0, 10)).y(), middle.y());
  }
}

TEST(PlaceCameras, AConesFirstCameraStandsOnItsAxis) {
  PlacementOptions options{.count = 8};
  options.cone = ViewingCone{.axis = {2, -5, 1}, .half_angle_rad = 0.4};
  const Placement placement = place_cameras(lumpy_mesh(50, 2), options);
  const Eigen::Vector3d axis = options.cone->axis.normalized();
  EXPECT_LT((placement.manifold.directions[0] - axis).norm(), 1e-6);
  for (const Eigen::Vector3d& d : placement.manifold.directions) {
    EXPECT_GE(d.dot(axis), std::cos(0.4) - 1e-6);
  }
}

TEST(PlaceCameras, UnusedVerticesDoNotCount) {
  TriangleMesh mesh = lumpy_mesh(50, 2);
  const Placement before = place_cameras(mesh, {});
  mesh.vertices.push_back({1e5, 0, 0});
  const Placement after = place_cameras(mesh, {});
  EXPECT_EQ(before.cameras[3].center_world_mm(), after.cameras[3].center_world_mm());
}

TEST(PlaceCameras, SurfacesWithoutExtentAreRefused) {
  EXPECT_THROW(place_cameras({}, {}), BadDataError);
  TriangleMesh mesh = tetrahedron_mesh();
  mesh.vertices.assign(4, {1, 2, 3});
  EXPECT_THROW(place_cameras(mesh, {}), BadDataError);
  mesh.vertices[2].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(place_cameras(mesh, {}), BadDataError);
}

// A sheet seen edge-on and a needle seen from its end have no size one way or both.
TEST(PlaceCameras, FlatAndThinSurfaces) {
  TriangleMesh sheet;
  sheet.vertices = {{0, 0, 0}, {0, 9, 0}, {0, 9, 9}, {0, 0, 9}};
  sheet.faces = {{0, 1, 2}, {0, 2, 3}};
  for (const PosedCamera& c : place_cameras(sheet, {}).cameras)
    EXPECT_NO_THROW(c.intrinsics.check());
  sheet.vertices = {{0, 0, 0}, {0, 9, 0}, {0, 5, 0}, {0, 3, 0}};
  for (const PosedCamera& c : place_cameras(sheet, {}).cameras)
    EXPECT_NO_THROW(c.intrinsics.check());
}

constexpr double kPi = std::numbers::pi;
// Where the search stops: forces vanish to rounding, angles are then good to its square root.
constexpr double kAtRest_rad = 1e-6;

std::vector<Eigen::Vector3d> all_round(int count) {
  return spread_directions(count, {0, -1, 0}, kPi);
}

double least_angle(const std::vector<Eigen::Vector3d>& directions) {
  double most_cosine = -1;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      most_cosine = std::max(most_cosine, directions[i].dot(directions[j]));
    }
  }
  return std::acos(most_cosine);
}

TEST(SpreadDirections, ReachTheKnownSolutions) {
  EXPECT_NEAR(least_angle(all_round(2)), kPi, kAtRest_rad);
  EXPECT_NEAR(least_angle(all_round(3)), 2 * kPi / 3, kAtRest_rad);
  EXPECT_NEAR(least_angle(all_round(4)), std::acos(-1.0 / 3), kAtRest_rad);  // tetrahedron
  EXPECT_NEAR(least_angle(all_round(6)), kPi / 2, kAtRest_rad);              // octahedron
  EXPECT_NEAR(least_angle(all_round(12)), std::atan(2.0), kAtRest_rad);      // icosahedron
}

TEST(SpreadDirections, StayInTheConeAndReachItsRim) {
  for (const double half_angle : {0.05, 0.5, 1.5}) {
    for (const int count : {2, 3, 4, 8, 20}) {
      const Eigen::Vector3d axis(1, -1, 1);
      double largest = 0;
      for (const auto& d : spread_directions(count, axis, half_angle)) {
        largest = std::max(largest, std::acos(std::min(1.0, d.dot(axis.normalized()))));
      }
      EXPECT_NEAR(largest, half_angle, 1e-6);
    }
  }
}

TEST(SpreadDirections, AreEven) {
  for (const int count : {16, 32, 64}) {
    // Hexagonal packing is the bound; a random set would be near 0, a spiral at 0.85 of this.
    const double bound = std::sqrt(8 * kPi / (std::sqrt(3.0) * count));
    EXPECT_GT(least_angle(all_round(count)), 0.85 * bound) << count;
  }
}

constexpr Annealing kShort{.moves = 2'000};

std::vector<SampleBits> random_sets(std::uint64_t seed, std::size_t candidates, std::size_t samples,
                                    double density) {
  std::vector<SampleBits> seen(candidates, SampleBits(samples));
  RandomStream random(seed);
  for (SampleBits& bits : seen) {
    for (std::size_t i = 0; i < samples; ++i) {
      if (random.uniform() < density) bits.set(i);
    }
  }
  return seen;
}

std::size_t covered_by(const std::vector<SampleBits>& seen, std::uint32_t subset, int overlap) {
  std::size_t covered = 0;
  for (std::size_t i = 0; i < seen[0].size(); ++i) {
    int times = 0;
    for (std::size_t c = 0; c < seen.size(); ++c) times += (subset >> c & 1) && seen[c].test(i);
    covered += times >= overlap;
  }
  return covered;
}

// By trying all subsets; the number of candidates + 1 when none does.
std::size_t true_fewest(const std::vector<SampleBits>& seen, const CoverGoal& goal) {
  std::size_t fewest = seen.size() + 1;
  for (std::uint32_t subset = 0; subset < (1u << seen.size()); ++subset) {
    const auto size = static_cast<std::size_t>(std::popcount(subset));
    if (size < fewest && covered_by(seen, subset, goal.overlap) >= goal.samples) fewest = size;
  }
  return fewest;
}

TEST(AnnealedCover, FindsTheTrueFewestOfSmallSets) {
  int compared = 0;
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    const auto seen = random_sets(seed, 11, 100, 0.35);
    for (const CoverGoal& goal : {CoverGoal{85, 1}, CoverGoal{70, 2}, CoverGoal{50, 3}}) {
      const std::size_t fewest = true_fewest(seen, goal);
      if (fewest > seen.size()) continue;
      const ChosenCover cover =
          annealed_cover(seen, greedy_cover(seen, {}, goal, seen.size()), goal, kShort);
      EXPECT_GE(cover.covered, goal.samples);
      EXPECT_EQ(cover.chosen.size(), fewest) << seed;
      EXPECT_TRUE(std::is_sorted(cover.chosen.begin(), cover.chosen.end()));
      std::uint32_t subset = 0;
      for (const std::uint32_t c : cover.chosen) subset |= 1u << c;
      EXPECT_EQ(covered_by(seen, subset, goal.overlap), cover.covered);
      ++compared;
    }
  }
  EXPECT_GT(compared, 40);
}

}  // namespace
}  // namespace organbake
