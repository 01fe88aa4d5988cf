// SPDX-License-Identifier: Apache-2.0

#include "organbake/geometry/smooth_skin.h"
#include "organbake/core/error.h"
#include "organbake/core/random.h"
#include "organbake/geometry/dense_solve.h"
#include "organbake/geometry/rigid_transform.h"
#include "organbake/geometry/shell.h"
#include "organbake/geometry/vertex_gradients.h"
#include "support/meshes.h"
#include "support/testing.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr double kRounding_mm = 1e-12;  // of sums of three products, on bodies of 40 mm

TEST(SmoothSkin, FacesOfAProxyFaceFollowOneAnotherAndCoverIt) {
  const TriangleMesh proxy = lumpy_mesh(40, 1);
  for (const std::uint32_t steps : {1u, 2u, 5u}) {
    const TriangleMesh skin = smooth_skin_mesh(proxy, flat_skin(proxy, steps));
    const std::size_t cells = std::size_t(steps) * steps;
    ASSERT_EQ(skin.faces.size(), proxy.faces.size() * cells);
    for (std::size_t f = 0; f < skin.faces.size(); ++f) {
      const auto [a, b, c] = skin.faces[f];
      const auto [p, q, r] = proxy.faces[f / cells];
      const Vector3d whole =
          (proxy.vertices[q] - proxy.vertices[p]).cross(proxy.vertices[r] - proxy.vertices[p]);
      const Vector3d part =
          (skin.vertices[b] - skin.vertices[a]).cross(skin.vertices[c] - skin.vertices[a]);
      EXPECT_LT((part * double(cells) - whole).norm(), 1e-9 * whole.norm())
          << "an equal share, turned as its face is";
    }
  }
}

TEST(SmoothSkin, CompletedWeightsSumToOne) {
  const TriangleMesh proxy = lumpy_mesh(40, 1);
  SmoothSkin skin = flat_skin(proxy, 3);
  for (double& w : skin.weight) w = static_cast<float>(w);
  complete_weights(skin);
  for (std::size_t n = 0; n < skin.node_count(); ++n) {
    double sum = 0;
    for (std::uint32_t k = skin.first[n]; k < skin.first[n + 1]; ++k) sum += skin.weight[k];
    EXPECT_NEAR(sum, 1, 4 * std::numeric_limits<double>::epsilon());
  }
}

TEST(SmoothSkin, WrongOnesAreRefused) {
  const TriangleMesh proxy = tetrahedron_mesh();
  const SmoothSkin good = flat_skin(proxy, 2);
  EXPECT_NO_THROW(check_smooth_skin(good, proxy, "skin"));
  const auto refused = [&](auto change) {
    SmoothSkin bad = good;
    change(bad);
    EXPECT_THROW(check_smooth_skin(bad, proxy, "skin"), BadDataError);
  };
  refused([](SmoothSkin& s) { s.steps = 3; });
  refused([](SmoothSkin& s) { s.steps = 0; });
  refused([](SmoothSkin& s) { s.carrier[4] = 4; });
  refused([](SmoothSkin& s) { s.weight[0] = std::numeric_limits<double>::quiet_NaN(); });
  refused([](SmoothSkin& s) { s.weight[0] += 0.01; });
  refused([](SmoothSkin& s) { s.weight[0] = 1e6, s.weight[1] = 1 - 1e6; });
  refused([](SmoothSkin& s) { s.first.back() -= 1; });
  refused([](SmoothSkin& s) { s.first[1] = s.first[0]; });
}

TEST(ShellSurface, WithoutASkinItIsTheProxy) {
  const TriangleMesh proxy = lumpy_mesh(40, 1);
  const ShellSurface shell(proxy);
  EXPECT_EQ(shell.faces_per_proxy_face(), 1u);
  EXPECT_EQ(shell.at_rest().faces, proxy.faces);
  EXPECT_EQ(shell.posed(proxy.vertices).vertices, proxy.vertices);
}

TEST(ShellSurface, MovesAsTheSkinIsCarried) {
  const TriangleMesh proxy = lumpy_mesh(40, 1);
  const ShellSurface shell(proxy, flat_skin(proxy, 4));
  EXPECT_EQ(shell.faces_per_proxy_face(), 16u);
  const auto affine = [](const Vector3d& p) -> Vector3d {
    return {1 + p.x() + 0.5 * p.y(), 3 - 0.2 * p.z() + p.y(), 2 * p.z()};
  };
  std::vector<Vector3d> moved = proxy.vertices;
  for (Vector3d& v : moved) v = affine(v);
  const TriangleMesh posed = shell.posed(moved);
  for (std::size_t n = 0; n < posed.vertices.size(); ++n)
    EXPECT_LT((posed.vertices[n] - affine(shell.at_rest().vertices[n])).norm(), kRounding_mm * 100);
}

using Eigen::Matrix3d;
using Motion = std::function<Vector3d(const Vector3d&)>;

constexpr double kSize_mm = 40;
constexpr double kSums_mm = 1e-11;  // of some dozen products, on bodies of 40 mm

// A surface that a motion has deformed.
struct Posed {
  TriangleMesh rest, mesh;
  std::vector<Matrix3d> changes;
  std::vector<ShellMatrix> shells;

  Posed(TriangleMesh surface, const Motion& motion) : rest(std::move(surface)), mesh(rest) {
    for (Vector3d& v : mesh.vertices) v = motion(v);
    const VertexGradients gradients(rest);
    const std::vector<Vector3d> normals = vertex_normals(mesh);
    for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v)
      changes.push_back(gradients.change(v, mesh.vertices, normals));
    shells = shell_matrices(mesh);
    for (std::uint32_t f = 0; f < shells.size(); ++f) bend_face(rest, f, changes, shells[f]);
  }
  Vector3d rest_point(std::uint32_t face, double b1, double b2) const {
    const auto [i, j, k] = rest.faces[face];
    return (1 - b1 - b2) * rest.vertices[i] + b1 * rest.vertices[j] + b2 * rest.vertices[k];
  }
};

TEST(VertexGradients, AtRestNothingChangesToTheBit) {
  const Posed still(lumpy_mesh(kSize_mm, 2), [](const Vector3d& p) { return p; });
  for (const Matrix3d& change : still.changes) EXPECT_EQ(change, Matrix3d::Zero());
  for (const ShellMatrix& shell : still.shells) EXPECT_FALSE(is_bent(shell));
}

TEST(VertexGradients, ARotationIsFoundAndBendsNothing) {
  const Matrix3d turn =
      Eigen::AngleAxisd(2.2, Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  const Posed turned(lumpy_mesh(kSize_mm, 2),
                     [&](const Vector3d& p) -> Vector3d { return turn * p + Vector3d(9, 0, -70); });
  for (const Matrix3d& change : turned.changes)
    EXPECT_LT((change + Matrix3d::Identity() - turn).norm(), kSums_mm);
  for (const ShellMatrix& shell : turned.shells) EXPECT_LT(shell.rightCols<3>().norm(), kSums_mm);
}

// Where vertices lie evenly a quadratic deformation is met exactly, between them, too.
TEST(VertexGradients, AQuadraticDeformationOfAGridIsExact) {
  const Motion bow = [](const Vector3d& p) -> Vector3d {
    const double x = p.x() / kSize_mm, y = p.y() / kSize_mm;
    return p + Vector3d(3 * x * y, -2 * x * x, 8 * x * x + 5 * x * y - 6 * y * y);
  };
  const Posed bowed(grid_box({kSize_mm, kSize_mm, 1}, 8), bow);
  // Within the upper side, whose outermost vertices see other sides.
  const auto within = [&](std::uint32_t v) {
    const Vector3d& p = bowed.rest.vertices[v];
    return p.z() > 0 && p.head<2>().lpNorm<Eigen::Infinity>() < 0.45 * kSize_mm;
  };
  int inner = 0;
  for (std::uint32_t f = 0; f < bowed.rest.faces.size(); ++f) {
    const Face& face = bowed.rest.faces[f];
    if (!std::all_of(face.begin(), face.end(), within)) continue;
    ++inner;
    for (const auto& [b1, b2] : {std::pair(0.5, 0.0), {0.5, 0.5}, {0.3, 0.3}, {0.1, 0.7}})
      EXPECT_LT((shell_point(bowed.shells[f], b1, b2, 0) - bow(bowed.rest_point(f, b1, b2))).norm(),
                kSums_mm);
  }
  EXPECT_GT(inner, 50);
}

// Dents over an uneven surface: between the vertices at least twice as near to the truth as flat
// faces are. What is left is of third order: a dent is no parabola.
TEST(VertexGradients, ADentIsFollowedBetweenTheVertices) {
  const TriangleMesh surface = lumpy_mesh(kSize_mm, 3);
  const Vector3d at = surface.vertices[17], into = -at.normalized();
  const Motion dent = [&](const Vector3d& p) -> Vector3d {
    constexpr double kSigma_mm = 15;
    return p + kSigma_mm * std::exp(-(p - at).squaredNorm() / (2 * kSigma_mm * kSigma_mm)) * into;
  };
  const Posed dented(surface, dent);
  const std::vector<ShellMatrix> flat = shell_matrices(dented.mesh);
  double bent_error2 = 0, flat_error2 = 0;
  for (std::uint32_t f = 0; f < flat.size(); ++f) {
    const Vector3d truth = dent(dented.rest_point(f, 0.3, 0.4));
    bent_error2 += (shell_point(dented.shells[f], 0.3, 0.4, 0) - truth).squaredNorm();
    flat_error2 += (shell_point(flat[f], 0.3, 0.4, 0) - truth).squaredNorm();
  }
  EXPECT_LT(std::sqrt(bent_error2), 0.5 * std::sqrt(flat_error2));
}

TEST(VertexGradients, FacesMeetAtTheirEdgesWhateverHappens) {
  RandomStream random(3);
  const Posed crumpled(lumpy_mesh(kSize_mm, 1), [&](const Vector3d& p) -> Vector3d {
    return p + 30 * Vector3d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
  });
  const auto middle_of = [&](std::uint32_t f, std::uint32_t a, std::uint32_t b) {
    const Face& face = crumpled.rest.faces[f];
    const auto weight = [&](int corner) {
      return face[corner] == a || face[corner] == b ? 0.5 : 0;
    };
    return shell_point(crumpled.shells[f], weight(1), weight(2), 0);
  };
  const VertexFaces round(crumpled.rest.faces, crumpled.rest.vertices.size());
  for (std::uint32_t f = 0; f < crumpled.rest.faces.size(); ++f) {
    const Face& face = crumpled.rest.faces[f];
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = face[k], b = face[(k + 1) % 3];
      const Vector3d chord = crumpled.mesh.vertices[b] - crumpled.mesh.vertices[a];
      const Vector3d middle = middle_of(f, a, b);
      // Never farther than a right angle over the edge takes it.
      EXPECT_LE((middle - crumpled.mesh.vertices[a] - 0.5 * chord).norm(),
                0.25 * chord.norm() + kSums_mm);
      for (const std::uint32_t other : round.of(a)) {
        if (!has_corner(crumpled.rest.faces[other], b)) continue;
        EXPECT_LT((middle_of(other, a, b) - middle).norm(), kSums_mm);
      }
    }
  }
}

// A vertex between faces without area knows no gradient, and its edges stay straight.
TEST(VertexGradients, SliversStayFlat) {
  TriangleMesh sliver;
  sliver.vertices = {{0, 0, 0}, {10, 0, 0}, {20, 0, 0}};
  sliver.faces = {{0, 1, 2}};
  const Posed posed(
      sliver, [](const Vector3d& p) -> Vector3d { return p + Vector3d(0, 0, p.x() * p.x()); });
  EXPECT_FALSE(is_bent(posed.shells[0]));
  EXPECT_TRUE(posed.shells[0].allFinite());
}

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kRounding = 1e-12;

TEST(DenseSolve, ReadsTheLowerTriangleAlone) {
  Eigen::Matrix3d matrix;
  matrix << 4, 100, 100, 1, 3, 100, -1, 0.5, 2;
  const Eigen::Matrix3d whole = matrix.selfadjointView<Eigen::Lower>();
  const Vector3d x(1, -2, 3);
  EXPECT_LT((solve_symmetric(matrix, whole * x) - x).norm(), kRounding);
}

TEST(DenseSolve, FindsTheLeastSquares) {
  MatrixXd rows(4, 2);
  rows << 1, 0, 1, 1, 1, 2, 1, 3;
  const auto line = solve_least_squares(rows, VectorXd(Eigen::Vector4d(1, 3, 5, 11)));
  ASSERT_TRUE(line);
  EXPECT_NEAR((*line)[0], 0.2, kRounding);
  EXPECT_NEAR((*line)[1], 3.2, kRounding);
}

TEST(DenseSolve, FindsNothingWhereTheRowsDoNotFixIt) {
  MatrixXd rows(3, 2);
  rows << 1, 2, 2, 4, -3, -6;
  EXPECT_FALSE(solve_least_squares(rows, VectorXd(Vector3d(1, 2, 3))));
}

TEST(RotationBetween, BringsOneDirectionToTheOtherByTheLeastTurn) {
  const Vector3d from(0, 0, 2), to(3, 0, 3);
  const Eigen::AngleAxisd turn(rotation_between(from, to));
  EXPECT_LT((turn * from.normalized() - to.normalized()).norm(), kRounding);
  EXPECT_NEAR(turn.angle(), M_PI / 4, kRounding);
  const Vector3d back = rotation_between(from, -from) * from;
  EXPECT_LT((back + from).norm(), 1e-6);
}

}  // namespace
}  // namespace organbake
