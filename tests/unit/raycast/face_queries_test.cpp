// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/raycast/face_queries.h"
#include "organbake/raycast/ray_scene.h"

#include <gtest/gtest.h>

#include "organbake/core/random.h"
#include "support/meshes.h"

namespace organbake {
namespace {

// A few roundings of numbers of size 1…10.
constexpr double kFaceRounding = 1e-13;

const FaceCorners kFace{{1, 2, 3}, {5, 2, 3}, {1, 8, 4}};

TEST(FaceQueries, CrossingReproducesItsPoint) {
  const Eigen::Vector3d target = kFace.a + 0.2 * (kFace.b - kFace.a) + 0.3 * (kFace.c - kFace.a);
  const Eigen::Vector3d origin(0, 0, -7);
  const PlaneCrossing at = cross_plane(kFace, origin, 2 * (target - origin));
  EXPECT_NEAR(at.t, 0.5, kFaceRounding);
  EXPECT_NEAR(at.u, 0.2, kFaceRounding);
  EXPECT_NEAR(at.v, 0.3, kFaceRounding);
  EXPECT_TRUE(at.inside_by(0.19));
  EXPECT_FALSE(at.inside_by(0.21));
}

TEST(FaceQueries, LineInThePlaneIsNowhereInside) {
  EXPECT_FALSE(cross_plane(kFace, kFace.a, kFace.b - kFace.a).inside_by(-1e9));
  const FaceCorners point{kFace.a, kFace.a, kFace.a};
  EXPECT_FALSE(cross_plane(point, {0, 0, 0}, {0, 0, 1}).inside_by(-1e9));
}

// The nearest of a dense lattice of the face's points is the truth to within the lattice's step.
TEST(FaceQueries, ClosestPointBeatsEveryLatticePoint) {
  constexpr int kSteps = 60;
  RandomStream random(7);
  for (int trial = 0; trial < 500; ++trial) {
    const auto any = [&] {
      return Eigen::Vector3d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    };
    const FaceCorners face{any(), any(), any()};
    const Eigen::Vector3d query = 2 * any();
    const double found = (closest_on_face(face, query) - query).norm();
    double lattice = 1e9;
    for (int i = 0; i <= kSteps; ++i) {
      for (int j = 0; i + j <= kSteps; ++j) {
        const Eigen::Vector3d p = face.a + double(i) / kSteps * (face.b - face.a) +
                                  double(j) / kSteps * (face.c - face.a);
        lattice = std::min(lattice, (p - query).norm());
      }
    }
    const double step = ((face.b - face.a).norm() + (face.c - face.a).norm()) / kSteps;
    EXPECT_LE(found, lattice + kFaceRounding);
    EXPECT_GE(found, lattice - step);
  }
}

TEST(FaceQueries, FacesWithoutAreaAreSegmentsAndPoints) {
  const Eigen::Vector3d query(0, 3, 0);
  const FaceCorners line{{-1, 0, 0}, {2, 0, 0}, {1, 0, 0}};
  EXPECT_NEAR((closest_on_face(line, query) - Eigen::Vector3d::Zero()).norm(), 0, kFaceRounding);
  const FaceCorners point{{1, 1, 1}, {1, 1, 1}, {1, 1, 1}};
  EXPECT_EQ(closest_on_face(point, query), Eigen::Vector3d(1, 1, 1));
}

// Answers are in double; only the scene's centring rounds (2⁻⁵² of the offset).
constexpr double kRounding = 1e-12;

ClosestPoint by_brute_force(const TriangleMesh& mesh, const Eigen::Vector3d& query) {
  ClosestPoint best;
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    const Face& face = mesh.faces[f];
    const Eigen::Vector3d p = closest_on_face(
        {mesh.vertices[face[0]], mesh.vertices[face[1]], mesh.vertices[face[2]]}, query);
    const double distance = (p - query).norm();
    if (distance < best.distance_mm) best = {f, p, distance};
  }
  return best;
}

TEST(ClosestPoint, EqualsBruteForce) {
  const TriangleMesh mesh = lumpy_mesh(50, 3);
  const RayScene scene(mesh);
  RandomStream random(1);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d query(random.uniform(-90, 90), random.uniform(-90, 90),
                                random.uniform(-90, 90));
    const ClosestPoint found = scene.closest_point(query), truth = by_brute_force(mesh, query);
    ASSERT_NEAR(found.distance_mm, truth.distance_mm, 100 * kRounding) << query.transpose();
    ASSERT_NEAR((found.point - query).norm(), found.distance_mm, 100 * kRounding);
  }
}

TEST(ClosestPoint, LowestFaceAmongEquallyNearOnes) {
  // Above a vertex of the top side all six of its faces are equally near.
  const TriangleMesh mesh = grid_box({4, 4, 4}, 4);
  const RayScene scene(mesh);
  const Eigen::Vector3d vertex(1, 1, 2);
  std::uint32_t lowest = kNoHit;
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    for (const std::uint32_t v : mesh.faces[f]) {
      if (mesh.vertices[v] == vertex) lowest = std::min(lowest, f);
    }
  }
  const ClosestPoint found = scene.closest_point(vertex + Eigen::Vector3d(0, 0, 3));
  EXPECT_EQ(found.face, lowest);
  EXPECT_EQ(found.distance_mm, 3);
}

TEST(ClosestPoint, LargeOffsetsCostNothing) {
  // Coordinates of 1e6 carry 1e-10 mm in double; in float they would carry 0.06 mm.
  constexpr double kOffsetRounding = 1e-9;
  const Eigen::Vector3d offset(1e6, -2e6, 5e5);
  const TriangleMesh mesh = lumpy_mesh(50, 3);
  const RayScene near(mesh), far(moved(mesh, offset));
  for (const Eigen::Vector3d& query : {Eigen::Vector3d(10, 20, 70), Eigen::Vector3d(1, 2, 3)}) {
    const ClosestPoint a = near.closest_point(query), b = far.closest_point(query + offset);
    EXPECT_NEAR(a.distance_mm, b.distance_mm, kOffsetRounding);
    EXPECT_LT((a.point + offset - b.point).norm(), kOffsetRounding);
  }
}

TEST(ClosestPoint, QueriesFromFarAway) {
  const RayScene scene(grid_box({2, 2, 2}, 1));
  for (const double height : {1e3, 1e6, 1e12, 1e100}) {
    const ClosestPoint found = scene.closest_point({0.25, 0.125, height});
    EXPECT_NEAR(found.distance_mm / (height - 1), 1, 1e-15);
  }
}

TEST(ClosestPoint, QueryThatIsNotFiniteFindsNothing) {
  const RayScene scene(tetrahedron_mesh());
  EXPECT_EQ(scene.closest_point({std::nan(""), 0, 0}).face, kNoHit);
  EXPECT_EQ(scene.closest_point({0, HUGE_VAL, 0}).face, kNoHit);
}

TEST(ClosestPoint, MeshOfFacesWithoutArea) {
  TriangleMesh line;
  line.vertices = {{0, 0, 0}, {2, 0, 0}, {4, 0, 0}};
  line.faces = {{0, 1, 2}};
  EXPECT_NEAR(RayScene(line).closest_point({3, 5, 0}).distance_mm, 5, kRounding);
  line.faces = {{1, 1, 1}};
  EXPECT_NEAR(RayScene(line).closest_point({2, 5, 0}).distance_mm, 5, kRounding);
}

}  // namespace
}  // namespace organbake
