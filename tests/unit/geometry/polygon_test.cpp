// SPDX-License-Identifier: Apache-2.0
#include "organbake/geometry/polygon.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include "organbake/core/random.h"
#include "organbake/geometry/mesh_checks.h"
#include "support/meshes.h"

namespace organbake {
namespace {

using Corners = std::vector<Eigen::Vector2d>;

double signed_area(const Corners& corners) {
  double area = 0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector2d &a = corners[i], &b = corners[(i + 1) % corners.size()];
    area += (a.x() * b.y() - a.y() * b.x()) / 2;
  }
  return area;
}

// The polygon in a tilted plane, cut.
TriangleMesh cut(const Corners& corners) {
  const Eigen::AngleAxisd tilt(0.7, Eigen::Vector3d(1, 2, 0.5).normalized());
  TriangleMesh mesh;
  for (const Eigen::Vector2d& c : corners)
    mesh.vertices.push_back(tilt * Eigen::Vector3d(c.x(), c.y(), 3));
  std::vector<std::uint32_t> polygon(corners.size());
  std::iota(polygon.begin(), polygon.end(), 0u);
  cut_polygon(mesh.vertices, polygon, mesh.faces);
  return mesh;
}

// Triangles that cover the polygon: no more area than it has, since none is turned over or lies
// upon another.
void expect_covers(const Corners& corners, const char* what) {
  const TriangleMesh mesh = cut(corners);
  EXPECT_EQ(mesh.faces.size(), corners.size() - 2) << what;
  const double area = signed_area(corners);
  EXPECT_NEAR(surface_area(mesh), area, 1e-6 * area) << what;
  const MeshTopology topology = analyse_topology(mesh);
  EXPECT_EQ(topology.boundary_edges, corners.size()) << what;
  EXPECT_EQ(topology.boundary_loops, 1u) << what;
  EXPECT_EQ(topology.non_manifold_edges + topology.misoriented_edges, 0u) << what;
}

Corners ring(std::size_t n, const std::function<double(std::size_t)>& radius) {
  Corners corners;
  for (std::size_t i = 0; i < n; ++i) {
    const double angle = 2 * M_PI * static_cast<double>(i) / static_cast<double>(n);
    corners.push_back(radius(i) * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
  }
  return corners;
}

// A band along a spiral: there along its outside, back along its inside.
Corners spiral(std::size_t half) {
  Corners corners;
  for (std::size_t i = 0; i < 2 * half; ++i) {
    const std::size_t along = i < half ? i : 2 * half - 1 - i;
    const double way = static_cast<double>(along) / static_cast<double>(half);
    const double radius = (i < half ? 7 : 5) + 40 * way, angle = 2 * M_PI * 10 * way;
    corners.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
  }
  if (signed_area(corners) < 0) std::reverse(corners.begin(), corners.end());
  return corners;
}

TEST(CutPolygon, CoversItExactly) {
  expect_covers({{0, 0}, {4, 0}, {4, 4}, {0, 4}}, "square");
  expect_covers({{0, 0}, {4, 0}, {1, 1}, {0, 4}}, "dart");
  expect_covers({{0, 0}, {2, 0}, {4, 0}, {4, 4}, {2, 4}, {0, 4}, {0, 2}}, "corners on its sides");
  expect_covers({{0, 0},
                 {6, 0},
                 {6, 4},
                 {5, 4},
                 {5, 1},
                 {4, 1},
                 {4, 4},
                 {3, 4},
                 {3, 1},
                 {2, 1},
                 {2, 4},
                 {0, 4}},
                "comb");
  RandomStream random(11);
  expect_covers(ring(500, [&](std::size_t) { return random.uniform(1, 50); }), "star");
  expect_covers(ring(501, [&](std::size_t) { return random.uniform(49.9, 50); }), "rough circle");
  expect_covers(spiral(400), "spiral");
}

TEST(CutPolygon, AConvexOneIsAFan) {
  const TriangleMesh mesh = cut(ring(9, [](std::size_t) { return 5; }));
  for (const Face& face : mesh.faces) EXPECT_EQ(face[0], 0u);
}

// With the square of the corners it would be minutes. The clock is the test runner's.
TEST(CutPolygon, TakesAHundredThousandCorners) {
  RandomStream random(12);
  expect_covers(ring(100'000, [&](std::size_t) { return random.uniform(49.99, 50); }), "circle");
  expect_covers(spiral(50'000), "spiral");
}

TEST(CutPolygon, OneThatCrossesItselfIsCutAllTheSame) {
  RandomStream random(13);
  Corners knot;
  for (int i = 0; i < 20'000; ++i) knot.emplace_back(random.uniform(0, 50), random.uniform(0, 50));
  EXPECT_EQ(cut(knot).faces.size(), knot.size() - 2);
  EXPECT_EQ(cut(Corners(1000, {1, 1})).faces.size(), 998u);
  Corners lost = ring(50, [](std::size_t i) { return i == 7 ? NAN : 5; });
  EXPECT_EQ(cut(lost).faces.size(), 48u);
  lost[7] = {1e300, -1e300};
  EXPECT_EQ(cut(lost).faces.size(), 48u);
}

TriangleMesh shifted(TriangleMesh mesh, RandomStream& random) {
  const Eigen::Vector3d shift(random.normal(), random.normal(), random.normal());
  for (Eigen::Vector3d& v : mesh.vertices)
    v = (v + 300 * shift).cast<float>().cast<double>();  // as files have them
  return mesh;
}

TEST(Weld, ASoupBecomesTheMeshThatItWas) {
  RandomStream random(3);
  for (int trial = 0; trial < 10; ++trial) {
    const TriangleMesh mesh = shifted(lumpy_mesh(40, 1 + trial % 5), random);
    TriangleMesh soup = soup_of(mesh);
    const WeldSummary summary = weld(soup);
    EXPECT_EQ(summary.exact, 3 * mesh.faces.size() - mesh.vertices.size());
    EXPECT_EQ(soup.vertices.size(), mesh.vertices.size());
    EXPECT_EQ(soup.faces.size(), mesh.faces.size());
    EXPECT_EQ(analyse_topology(soup).boundary_edges, 0u);
  }
}

TEST(Weld, NearlyTheSamePlaceIsOneWhereThatClosesTheMesh) {
  RandomStream random(4);
  const TriangleMesh mesh = lumpy_mesh(40, 3);
  TriangleMesh soup = soup_of(mesh);
  for (Eigen::Vector3d& v : soup.vertices)
    v += 1e-6 * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
  EXPECT_GT(weld(soup).near, 0u);
  EXPECT_EQ(soup.vertices.size(), mesh.vertices.size());
  EXPECT_EQ(analyse_topology(soup).boundary_edges, 0u);
}

TEST(Weld, AClosedMeshStaysAsItIs) {
  TriangleMesh mesh = lumpy_mesh(40, 2);
  const std::vector<Eigen::Vector3d> before = mesh.vertices;
  EXPECT_EQ(weld(mesh).exact, 0u);
  EXPECT_EQ(mesh.vertices, before);
}

}  // namespace
}  // namespace organbake
