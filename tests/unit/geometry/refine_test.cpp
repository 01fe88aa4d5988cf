// SPDX-License-Identifier: Apache-2.0
#include "organbake/geometry/refine.h"

#include "organbake/core/error.h"
#include "organbake/core/random.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/polygon.h"
#include "organbake/geometry/smooth_skin.h"
#include "support/meshes.h"
#include "support/testing.h"

namespace organbake {
namespace {

double longest_edge(const TriangleMesh& mesh) {
  double longest = 0;
  for (const Face& f : mesh.faces)
    for (int i = 0; i < 3; ++i)
      longest = std::max(longest, (mesh.vertices[f[i]] - mesh.vertices[f[(i + 1) % 3]]).norm());
  return longest;
}

TEST(RefineEdges, KeepsTheSurfaceAndLeavesNoLongEdge) {
  const TriangleMesh lumpy = lumpy_mesh(50, 2);
  for (const double longest : {40.0, 9.0, 4.0}) {
    const RefinedMesh fine = refine_edges(lumpy, longest);
    EXPECT_LE(longest_edge(fine.mesh), longest);
    EXPECT_TRUE(analyse_topology(fine.mesh).closed_manifold());
    EXPECT_NEAR(signed_volume(fine.mesh), signed_volume(lumpy), 1e-9 * signed_volume(lumpy));
    EXPECT_NEAR(surface_area(fine.mesh), surface_area(lumpy), 1e-9 * surface_area(lumpy));
  }
}

TEST(RefineEdges, KnowsWhereEachVertexLies) {
  const TriangleMesh box = box_mesh({7, 2, 5});
  const RefinedMesh fine = refine_edges(box, 0.8);
  ASSERT_EQ(fine.places.size(), fine.mesh.vertices.size());
  for (std::size_t v = 0; v < fine.places.size(); ++v) {
    const auto& [face, u, w] = fine.places[v];
    const Face& f = box.faces[face];
    const Eigen::Vector3d there =
        (1 - u - w) * box.vertices[f[0]] + u * box.vertices[f[1]] + w * box.vertices[f[2]];
    EXPECT_LT((there - fine.mesh.vertices[v]).norm(), 1e-5);
  }
}

TEST(RefineEdges, LeavesAFineMeshAlone) {
  const TriangleMesh sphere = sphere_mesh(1, 3);
  const RefinedMesh same = refine_edges(sphere, 10);
  EXPECT_EQ(same.mesh.faces, sphere.faces);
  EXPECT_EQ(same.mesh.vertices, sphere.vertices);
}

TEST(RefineEdges, RefusesWhatMakesNoSense) {
  const TriangleMesh box = box_mesh({1, 1, 1});
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_THROW(refine_edges(box, bad), UsageError);
  EXPECT_THROW(refine_edges(box, 1e-3, 10'000), UsageError);
}

TEST(Icosphere, IsAClosedSphereOfTwentyTimesFourToTheN) {
  std::size_t faces = 20;
  for (int subdivisions = 0; subdivisions <= 4; ++subdivisions, faces *= 4) {
    const TriangleMesh sphere = make_icosphere(subdivisions);
    const MeshTopology topology = analyse_topology(sphere);
    EXPECT_EQ(sphere.faces.size(), faces);
    EXPECT_TRUE(topology.closed_manifold());
    EXPECT_EQ(topology.euler_characteristic, 2);
    EXPECT_GT(signed_volume(sphere), 0) << "faces must look outward";
    for (const auto& vertex : sphere.vertices) EXPECT_NEAR(vertex.norm(), 1, 1e-15);
  }
}

TEST(Icosphere, CoarseVerticesComeFirst) {
  const TriangleMesh coarse = make_icosphere(2), fine = make_icosphere(3);
  for (std::size_t v = 0; v < coarse.vertices.size(); ++v)
    EXPECT_EQ(coarse.vertices[v], fine.vertices[v]);
}

TEST(Icosphere, RefusesOddCounts) {
  EXPECT_THROW(make_icosphere(-1), UsageError);
  EXPECT_THROW(make_icosphere(10), UsageError);
}

using Eigen::Vector3d;

Vector3d random_point(RandomStream& random) {
  return {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
}

TEST(NearestOnTriangle, NoSampledPointIsNearer) {
  RandomStream random(3);
  for (int round = 0; round < 300; ++round) {
    const Vector3d a = random_point(random), b = random_point(random), c = random_point(random),
                   p = 2 * random_point(random);
    const Vector3d w = nearest_on_triangle(p, a, b, c);
    ASSERT_GE(w.minCoeff(), -1e-12);
    ASSERT_NEAR(w.sum(), 1, 1e-12);
    const double found = (w[0] * a + w[1] * b + w[2] * c - p).norm();
    for (int sample = 0; sample < 200; ++sample) {
      double u = random.uniform(), v = random.uniform();
      if (u + v > 1) u = 1 - u, v = 1 - v;
      ASSERT_LE(found, ((1 - u - v) * a + u * b + v * c - p).norm() + 1e-12);
    }
  }
}

TEST(NearestOnTriangle, APointGivesThePoint) {
  const Vector3d a(1, 2, 3);
  const Vector3d w = nearest_on_triangle({0, 0, 0}, a, a, a);
  EXPECT_TRUE(w.allFinite());
  EXPECT_NEAR(w.sum(), 1, 1e-15);
}

class LatticeOfSteps : public ::testing::TestWithParam<std::uint32_t> {};
INSTANTIATE_TEST_SUITE_P(Steps, LatticeOfSteps, ::testing::Values(1, 2, 3, 4, 7));

TEST_P(LatticeOfSteps, NodesLieWhereTheirFacesPutThem) {
  const TriangleMesh proxy = lumpy_mesh(20, 1);
  const std::vector<Vector3d> normals = vertex_normals(proxy);
  const std::uint32_t n = GetParam();
  const Lattice lattice(proxy, n);
  const auto lines = lattice.shell_lines();
  ASSERT_EQ(lines.size(), lattice.node_count());
  std::set<std::uint32_t> used;
  for (std::uint32_t f = 0; f < proxy.faces.size(); ++f)
    for (std::uint32_t i = 0; i <= n; ++i)
      for (std::uint32_t j = 0; i + j <= n; ++j) {
        const std::uint32_t node = lattice.node(f, i, j);
        ASSERT_LT(node, lines.size());
        used.insert(node);
        const double b1 = double(i) / n, b2 = double(j) / n;
        const Face& face = proxy.faces[f];
        const auto mixed = [&](const std::vector<Vector3d>& at) -> Vector3d {
          return (1 - b1 - b2) * at[face[0]] + b1 * at[face[1]] + b2 * at[face[2]];
        };
        EXPECT_LT((lines[node].foot - mixed(proxy.vertices)).norm(), 1e-12);
        EXPECT_LT((lines[node].direction - mixed(normals)).norm(), 1e-12);
      }
  EXPECT_EQ(used.size(), lines.size()) << "every node belongs to a face";
  // Euler: V + E (n − 1) + F (n − 1)(n − 2) / 2 on a closed surface.
  const std::size_t edges = proxy.faces.size() * 3 / 2;
  EXPECT_EQ(lines.size(),
            proxy.vertices.size() + edges * (n - 1) + proxy.faces.size() * ((n - 1) * (n - 2) / 2));
}

TEST(LatticeSteps, FollowTheEdgeLengthWithinBounds) {
  TriangleMesh proxy;  // edges of 30, 40 and 50 mm
  proxy.vertices = {{0, 0, 0}, {30, 0, 0}, {0, 40, 0}};
  proxy.faces = {{0, 1, 2}};
  EXPECT_EQ(lattice_steps(proxy, 2, 1000000), 20u);
  EXPECT_EQ(lattice_steps(proxy, 0.01, 1000000), 64u);
  EXPECT_EQ(lattice_steps(proxy, 1000, 1000000), 1u);
  EXPECT_EQ(lattice_steps(proxy, 2, 100), 12u);  // 13 · 14 / 2 = 91 nodes
  EXPECT_EQ(lattice_steps(proxy, 2, 1), 1u);
}

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

}  // namespace
}  // namespace organbake
