// SPDX-License-Identifier: GPL-3.0-or-later

#include <Eigen/LU>

#include "organbake/core/error.h"
#include "organbake/core/random.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/viewpoints/placement.h"
#include "placing.h"
#include "support/testing.h"

namespace organbake {
namespace {

constexpr double kHalfTurn = std::numbers::pi;
constexpr int kDirections = 10'000;
// A random direction this near to an edge (in cone coordinates) belongs to either side.
constexpr double kOnEdge = 1e-9;

const Eigen::Vector3d kCenter(10, -20, 30);

Placement manifold_of(const std::vector<Eigen::Vector3d>& directions, double distance = 250) {
  std::vector<Eigen::Vector3d> eyes;
  for (const auto& d : directions) eyes.push_back(kCenter + distance * d.normalized());
  Placement placement;
  build_view_manifold(kCenter, eyes, placement);
  return placement;
}

Eigen::Vector3d cone_coordinates(const ViewManifold& manifold, std::size_t triangle,
                                 const Eigen::Vector3d& direction) {
  Eigen::Matrix3d corners;
  for (int c = 0; c < 3; ++c) {
    corners.col(c) = manifold.directions[manifold.triangles[triangle][c]];
  }
  return corners.inverse() * direction;
}

// How many triangles the direction pierces; −1 when it is too near to an edge to tell.
int pierced(const ViewManifold& manifold, const Eigen::Vector3d& direction) {
  int count = 0;
  for (std::size_t t = 0; t < manifold.triangles.size(); ++t) {
    const double least = cone_coordinates(manifold, t, direction).minCoeff();
    if (std::abs(least) < kOnEdge) return -1;
    count += least > 0;
  }
  return count;
}

Eigen::Vector3d random_direction(RandomStream& random) {
  return Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
}

void expect_sound_triangles(const ViewManifold& manifold) {
  EXPECT_TRUE(std::is_sorted(manifold.triangles.begin(), manifold.triangles.end()));
  for (const auto& t : manifold.triangles) {
    EXPECT_LT(t[0], std::min(t[1], t[2]));
    const auto& d = manifold.directions;
    EXPECT_GT(d[t[0]].dot(d[t[1]].cross(d[t[2]])), 0) << "seen from outside";
  }
}

// Euler: a triangulated sphere of n vertices has 2n − 4 triangles, and covers every direction once.
void expect_covers_the_sphere(const std::vector<Eigen::Vector3d>& directions) {
  const Placement placement = manifold_of(directions);
  EXPECT_EQ(placement.manifold.triangles.size(), 2 * directions.size() - 4);
  expect_sound_triangles(placement.manifold);
  RandomStream random(11);
  int counted = 0;
  for (int i = 0; i < kDirections; ++i) {
    const int count = pierced(placement.manifold, random_direction(random));
    if (count < 0) continue;
    ASSERT_EQ(count, 1);
    ++counted;
  }
  EXPECT_GT(counted, kDirections - 10);
  EXPECT_TRUE(analyse_topology(placement.manifold_surface).closed_manifold());
}

TEST(ViewManifold, EvenSetsCoverEveryDirectionOnce) {
  for (const int count : {4, 5, 6, 7, 8, 12, 20, 50}) {
    SCOPED_TRACE(count);
    expect_covers_the_sphere(spread_directions(count, {0, -1, 0}, kHalfTurn));
  }
}

TEST(ViewManifold, RandomSetsCoverEveryDirectionOnce) {
  RandomStream random(12);
  for (int set = 0; set < 5; ++set) {
    std::vector<Eigen::Vector3d> directions;
    for (int i = 0; i < 24; ++i) directions.push_back(random_direction(random));
    expect_covers_the_sphere(directions);
  }
}

// The corners of a cube: every face of it is one vertex of four view planes.
TEST(ViewManifold, VerticesOfFourPlanesAreFannedFromTheLowestCamera) {
  std::vector<Eigen::Vector3d> cube;
  for (int i = 0; i < 8; ++i) {
    cube.push_back({i & 1 ? 1.0 : -1.0, i & 2 ? 1.0 : -1.0, i & 4 ? 1.0 : -1.0});
  }
  expect_covers_the_sphere(cube);
  const auto triangles = manifold_of(cube).manifold.triangles;
  // The face of 0, 1, 2, 3 is split from 0, so along its diagonal 0–3; the same for its opposite.
  const auto has_edge = [&](std::uint32_t a, std::uint32_t b) {
    return std::any_of(triangles.begin(), triangles.end(), [&](const auto& t) {
      return std::count(t.begin(), t.end(), a) && std::count(t.begin(), t.end(), b);
    });
  };
  EXPECT_TRUE(has_edge(0, 3));
  EXPECT_FALSE(has_edge(1, 2));
  EXPECT_TRUE(has_edge(4, 7));
  // The rule holds however the set is turned, when its symmetry is one of rounding only.
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  for (auto& d : cube) d = turn * d;
  EXPECT_EQ(manifold_of(cube).manifold.triangles, triangles);
}

// Inside a cone the triangles cover the hull of the directions, without holes or overlap.
TEST(ViewManifold, AConesHullIsCoveredOnce) {
  for (const double half_angle : {0.1, 0.5, 1.2, 1.5}) {
    for (const int count : {3, 4, 5, 8, 12, 20, 33}) {
      SCOPED_TRACE(testing::Message() << count << " cameras in " << half_angle << " rad");
      const auto directions = spread_directions(count, {1, -2, 0.5}, half_angle);
      const ViewManifold manifold = manifold_of(directions).manifold;
      expect_sound_triangles(manifold);
      RandomStream random(13);
      for (int i = 0; i < 2000; ++i) {
        // A positive mixture of the directions lies in their spherical hull.
        Eigen::Vector3d mixed = Eigen::Vector3d::Zero();
        for (const auto& d : directions) mixed -= std::log(1 - random.uniform()) * d;
        const int count_pierced = pierced(manifold, mixed.normalized());
        if (count_pierced >= 0) {
          ASSERT_EQ(count_pierced, 1);
        }
      }
      EXPECT_EQ(pierced(manifold, -Eigen::Vector3d(1, -2, 0.5)), 0);
    }
  }
}

TEST(ViewManifold, ThreeCamerasOfAConeMakeTheOneTriangle) {
  const ViewManifold manifold = manifold_of(spread_directions(3, {0, -1, 0}, 0.5)).manifold;
  ASSERT_EQ(manifold.triangles.size(), 1u);
  EXPECT_EQ(pierced(manifold, {0, -1, 0}), 1);
}

TEST(ViewManifold, SetsThatSpanNoTriangleHaveNone) {
  EXPECT_TRUE(manifold_of({}).manifold.triangles.empty());
  EXPECT_TRUE(manifold_of({{0, -1, 0}}).manifold.triangles.empty());
  EXPECT_TRUE(manifold_of({{0, -1, 0}, {1, 0, 0}}).manifold.triangles.empty());
  EXPECT_TRUE(manifold_of({{0, -1, 0}, {0, 1, 0}}).manifold.triangles.empty());
  std::vector<Eigen::Vector3d> ring;
  for (int i = 0; i < 12; ++i)
    ring.push_back({std::cos(kHalfTurn * i / 6), std::sin(kHalfTurn * i / 6), 0});
  const Placement placement = manifold_of(ring);
  EXPECT_TRUE(placement.manifold.triangles.empty());
  EXPECT_EQ(placement.manifold.directions.size(), 12u);
  // The fall-back of the weights still serves a view.
  const ViewWeights weights = view_weights(placement.manifold, {1, 0.1, 0});
  EXPECT_NEAR(weights.weights[0] + weights.weights[1] + weights.weights[2], 1, 1e-12);
}

TEST(ViewManifold, ARingWithAPoleCoversItsHalf) {
  std::vector<Eigen::Vector3d> directions = {{0, 0, 1}};
  for (int i = 0; i < 8; ++i) {
    directions.push_back({std::cos(kHalfTurn * i / 4), std::sin(kHalfTurn * i / 4), 0});
  }
  const ViewManifold manifold = manifold_of(directions).manifold;
  EXPECT_EQ(manifold.triangles.size(), 8u);
  EXPECT_EQ(pierced(manifold, {0.2, 0.1, 0.5}), 1);
  EXPECT_EQ(pierced(manifold, {0.2, 0.1, -0.5}), 0);
}

TEST(ViewManifold, ACircleOfCamerasIsOneFan) {
  std::vector<Eigen::Vector3d> circle;
  for (int i = 0; i < 7; ++i) {
    circle.push_back({std::cos(2 * kHalfTurn * i / 7), std::sin(2 * kHalfTurn * i / 7), 2});
  }
  const ViewManifold manifold = manifold_of(circle).manifold;
  ASSERT_EQ(manifold.triangles.size(), 5u);
  for (const auto& t : manifold.triangles) EXPECT_EQ(t[0], 0u);
}

TEST(ViewManifold, DirectionsAndDistancesAreKept) {
  const auto directions = spread_directions(8, {0, -1, 0}, kHalfTurn);
  const Placement placement = manifold_of(directions, 321);
  EXPECT_EQ(placement.manifold.center_world_mm, kCenter);
  for (std::size_t c = 0; c < directions.size(); ++c) {
    EXPECT_LT((placement.manifold.directions[c] - directions[c]).norm(), 1e-14);
  }
  // The surface touches every view plane and goes beyond none.
  for (const auto& d : directions) {
    double farthest = 0;
    for (const auto& vertex : placement.manifold_surface.vertices) {
      farthest = std::max(farthest, d.dot(vertex - kCenter));
    }
    EXPECT_NEAR(farthest, 321, 1e-9);
  }
}

TEST(ViewManifold, UnusableEyesAreRefused) {
  EXPECT_THROW(manifold_of({{0, -1, 0}, {1, 0, 0}, {0, -1, 0}}), BadDataError);
  EXPECT_THROW(manifold_of({{0, -1, 0}, {1e-6, -1, 0}}), BadDataError);
  Placement placement;
  EXPECT_THROW(build_view_manifold(kCenter, {kCenter}, placement), BadDataError);
  EXPECT_THROW(build_view_manifold(kCenter, {{std::nan(""), 0, 0}}, placement), BadDataError);
  EXPECT_THROW(build_view_manifold(kCenter, {{HUGE_VAL, 0, 0}}, placement), BadDataError);
}

}  // namespace
}  // namespace organbake
