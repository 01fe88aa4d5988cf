// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/raycast/face_queries.h"

#include "organbake/core/random.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/raycast/ray_scene.h"
#include "support/meshes.h"
#include "support/testing.h"

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

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kExact = 1e-9;  // of a volume: the same corners, other sums

// The volume after turning, as a share of what is right.
double turned_share(TriangleMesh mesh, double right_mm3) {
  turn_outward(mesh);
  return signed_volume(mesh) / right_mm3;
}

TEST(TurnOutward, WhatIsRightStaysAsItIs) {
  const TriangleMesh organ = joined(lumpy_mesh(40, 3), moved(lumpy_mesh(20, 2), {100, 0, 0}));
  TriangleMesh same = organ;
  EXPECT_THAT(turn_outward(same).sentences(), IsEmpty());
  EXPECT_EQ(same.faces, organ.faces);
}

TEST(TurnOutward, WhatIsWoundInwardIsTurned) {
  const TriangleMesh organ = lumpy_mesh(40, 3), other = moved(lumpy_mesh(20, 2), {100, 0, 0});
  TriangleMesh inward = inside_out(organ);
  EXPECT_THAT(turn_outward(inward).sentences(), ElementsAre(HasSubstr("1 piece that was wound")));
  EXPECT_EQ(signed_volume(inward), signed_volume(organ));
  const double both = signed_volume(organ) + signed_volume(other);
  EXPECT_NEAR(turned_share(joined(organ, inside_out(other)), both), 1, kExact);
  EXPECT_NEAR(turned_share(joined(inside_out(organ), other), both), 1, kExact);
  EXPECT_NEAR(turned_share(inside_out(joined(organ, other)), both), 1, kExact);
}

TEST(TurnOutward, FacesWoundAtRandomAreWoundAlikeFirst) {
  TriangleMesh organ = lumpy_mesh(40, 3);
  const double volume = signed_volume(organ);
  std::size_t swapped = 0;
  for (std::size_t f = 0; f < organ.faces.size(); f += 3, ++swapped)
    std::swap(organ.faces[f][0], organ.faces[f][1]);
  EXPECT_EQ(turn_outward(organ).faces, swapped);
  EXPECT_EQ(analyse_topology(organ).misoriented_edges, 0u);
  EXPECT_NEAR(signed_volume(organ) / volume, 1, kExact);
}

TEST(TurnOutward, APieceWithinAnotherIsTheWallOfACavity) {
  const TriangleMesh organ = lumpy_mesh(40, 3), hollow = sphere_mesh(20, 2),
                     core = sphere_mesh(5, 1);
  const double volume = signed_volume(organ) - signed_volume(hollow);
  for (const TriangleMesh& outer : {organ, inside_out(organ)})
    for (const TriangleMesh& inner : {hollow, inside_out(hollow)}) {
      EXPECT_NEAR(turned_share(joined(outer, inner), volume), 1, kExact);
      EXPECT_NEAR(turned_share(joined(joined(inside_out(core), inner), outer),
                               volume + signed_volume(core)),
                  1, kExact);
    }
}

// Of the smaller ball nine tenths of the way lie inside the larger one, its first corner as well.
TEST(TurnOutward, APieceThatCrossesAnotherIsASolid) {
  const TriangleMesh large = sphere_mesh(30, 3), small = sphere_mesh(15, 3);
  for (const Eigen::Vector3d& by : {Eigen::Vector3d(24, 0, 0), Eigen::Vector3d(-24, 0, 0),
                                    Eigen::Vector3d(0, 21, 8), Eigen::Vector3d(5, -8, 22)}) {
    const double sum = signed_volume(large) + signed_volume(small);
    EXPECT_NEAR(turned_share(joined(large, moved(small, by)), sum), 1, kExact);
    EXPECT_NEAR(turned_share(joined(inside_out(large), inside_out(moved(small, by))), sum), 1,
                kExact);
  }
}

TEST(TurnOutward, ASmallHoleDoesNotHideWhichSideIsOut) {
  TriangleMesh organ = inside_out(lumpy_mesh(40, 3));
  organ.faces.resize(organ.faces.size() - 12);
  EXPECT_EQ(turn_outward(organ).outward, 1u);
  EXPECT_GT(signed_volume(organ), 0);
}

TEST(TurnOutward, AnOpenSheetKeepsTheSideThatItShows) {
  for (const TriangleMesh& sheet :
       {cut_in_half(sphere_mesh(40, 3), {0, 0, 1}, 25), cut_in_half(lumpy_mesh(40, 3), {1, 0, 0})})
    for (TriangleMesh side : {sheet, inside_out(sheet)}) {
      const std::vector<Face> before = side.faces;
      EXPECT_THAT(turn_outward(side).sentences(), IsEmpty());
      EXPECT_EQ(side.faces, before);
    }
}

TEST(PiecesOf, KnowTheirVolumeAndWhetherTheyAreClosed) {
  const auto pieces =
      pieces_of(joined(box_mesh({2, 3, 4}), cut_in_half(sphere_mesh(40, 4), {0, 0, 1})));
  ASSERT_EQ(pieces.size(), 2u);
  EXPECT_TRUE(pieces[0].closed);
  EXPECT_NEAR(pieces[0].volume_mm3, 24, kExact);
  EXPECT_NEAR(pieces[0].area_mm2, 52, kExact);
  EXPECT_NEAR(pieces[0].open_share, 0, kExact);
  EXPECT_FALSE(pieces[1].closed);
  constexpr double kFacets = 0.03;
  EXPECT_NEAR(pieces[1].open_share, 0.5, kFacets) << "a half ball's rim against its face";
}

}  // namespace
}  // namespace organbake
