// SPDX-License-Identifier: GPL-3.0-or-later
#include "view_planes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "organbake/geometry/mesh_checks.h"
#include "spread_directions.h"

namespace organbake {
namespace {

constexpr double kFarBox = 1 << 20;
constexpr double kPlaneRounding = 1e-12;

TEST(ViewPlanes, TwentyEvenPlanesHave36Vertices) {
  const auto directions = spread_directions(20, {0, -1, 0}, std::numbers::pi);
  const PlanePolyhedron polyhedron = intersect_view_planes(directions, kFarBox);
  EXPECT_EQ(polyhedron.vertices.size(), 36u);
  for (const auto& vertex : polyhedron.vertices) {
    EXPECT_EQ(vertex.planes.size(), 3u);
    EXPECT_FALSE(vertex.on_box);
    for (const std::uint32_t plane : vertex.planes) {
      EXPECT_NEAR(directions[plane].dot(vertex.position), 1, kPlaneRounding);
    }
    for (const auto& d : directions) EXPECT_LE(d.dot(vertex.position), 1 + kPlaneRounding);
  }
  EXPECT_TRUE(analyse_topology(polyhedron.surface).closed_manifold());
  EXPECT_GT(signed_volume(polyhedron.surface), 4.0 / 3 * std::numbers::pi);
}

TEST(ViewPlanes, OnePlaneCutsTheBox) {
  const PlanePolyhedron half = intersect_view_planes({{0, 0, 1}}, 4);
  EXPECT_EQ(half.vertices.size(), 8u);
  EXPECT_NEAR(signed_volume(half.surface), 8 * 8 * 5, kPlaneRounding * 100);
  for (const auto& vertex : half.vertices) EXPECT_TRUE(vertex.on_box);
}

// Four planes meet in each vertex of an octahedron; rounding would split it into two.
TEST(ViewPlanes, WhatManyPlanesShareIsOneVertex) {
  std::vector<Eigen::Vector3d> corners;
  for (const double x : {-1, 1})
    for (const double y : {-1, 1})
      for (const double z : {-1, 1}) corners.push_back(Eigen::Vector3d(x, y, z).normalized());
  const PlanePolyhedron octahedron = intersect_view_planes(corners, kFarBox);
  ASSERT_EQ(octahedron.vertices.size(), 6u);
  for (const auto& vertex : octahedron.vertices) {
    EXPECT_EQ(vertex.planes.size(), 4u);
    EXPECT_NEAR(vertex.position.norm(), std::sqrt(3.0), kPlaneRounding);
  }
  EXPECT_EQ(octahedron.surface.faces.size(), 8u);
  EXPECT_TRUE(analyse_topology(octahedron.surface).closed_manifold());
  EXPECT_NEAR(signed_volume(octahedron.surface), 4.0 / 3 * std::pow(3.0, 1.5),
              kPlaneRounding * 100);
}

}  // namespace
}  // namespace organbake
