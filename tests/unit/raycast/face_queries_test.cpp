// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/raycast/face_queries.h"

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

}  // namespace
}  // namespace organbake
