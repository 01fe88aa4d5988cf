// SPDX-License-Identifier: Apache-2.0
#include "organbake/geometry/shell.h"

#include "organbake/core/error.h"
#include "organbake/core/random.h"
#include "support/meshes.h"
#include "support/testing.h"

namespace organbake {
namespace {

// Binding solves a cubic in doubles; a micrometre's thousandth is far above its rounding.
constexpr double kExactMm = 1e-6;

struct Shell {
  TriangleMesh proxy;
  std::vector<Eigen::Vector3d> normals;
  explicit Shell(TriangleMesh mesh) : proxy(std::move(mesh)), normals(vertex_normals(proxy)) {}
  Eigen::Vector3d point(const ShellBinding& b) const {
    return shell_point(shell_matrix(proxy, normals, b.face), b.b1, b.b2, b.height_mm);
  }
};

TEST(ShellMap, MacroPlusMicroIsTheSurface) {
  const Shell shell(lumpy_mesh(50, 1));  // 80 faces
  const TriangleMesh surface = lumpy_mesh(51, 4);
  const ShellBinder binder(shell.proxy, 15);
  for (const auto& p : surface.vertices) {
    const ShellBinding b = binder.bind(p);
    EXPECT_TRUE(binder.inside(b, p));
    EXPECT_LT((shell.point(b) - p).norm(), kExactMm);
  }
}

TEST(ShellMap, OfAProxyFoldedFlatNoPrismClaimsWhatItDoesNotHold) {
  TriangleMesh flat = lumpy_mesh(50, 1);
  for (auto& v : flat.vertices) v.y() *= 1e-9;
  const Shell shell(flat);
  const ShellBinder binder(flat, 10);
  RandomStream random(3);
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector3d p(random.uniform(-50, 50), random.uniform(-1e-6, 1e-6),
                            random.uniform(-50, 50));
    const ShellBinding b = binder.bind(p);
    if (!binder.inside(b, p)) continue;
    EXPECT_LT((shell.point(b) - p).norm(), 1e-3);
  }
}

// Beside a crease a point near the skin may lie in no prism, and the planes of the nearest face
// meet it only far away: bound there, a poke would fling it out of the picture.
TEST(ShellMap, BesideACreaseNothingIsBoundFarAway) {
  constexpr double kNear_mm = 2, kFar_mm = 40;
  TriangleMesh creased = lumpy_mesh(50, 2);
  RandomStream random(11);
  for (auto& v : creased.vertices) v *= random.uniform(0.5, 1.5);
  const ShellBinder binder(creased, kNear_mm);
  int outside = 0;
  for (int i = 0; i < 20000; ++i) {
    const auto& v = creased.vertices[random.below(creased.vertices.size())];
    const Eigen::Vector3d p = v + Eigen::Vector3d(random.uniform(-kNear_mm, kNear_mm),
                                                  random.uniform(-kNear_mm, kNear_mm),
                                                  random.uniform(-kNear_mm, kNear_mm));
    const ShellBinding b = binder.bind(p);
    if (binder.inside(b, p)) continue;
    ++outside;
    EXPECT_LT(std::abs(b.height_mm), kFar_mm);
    EXPECT_LT(std::max(std::abs(b.b1), std::abs(b.b2)), 3) << "faces away from its own";
  }
  EXPECT_GT(outside, 10);
}

// Where a body's prisms close, about its middle, a height that is stored rounded must not throw the
// point across the body.
TEST(ShellMap, ARoundedHeightStillGivesThePointBack) {
  constexpr double kRounding_mm = 1e-4;  // of heights at depths of some hundred millimetres
  const Shell shell(box_mesh({100, 100, 100}));
  const ShellBinder binder(shell.proxy, 200);
  const std::vector<ShellMatrix> matrices = shell_matrices(shell.proxy);
  const Eigen::Vector3d middle = bounds(shell.proxy).center();
  RandomStream random(7);
  for (int i = 0; i < 3000; ++i) {
    const double away = std::pow(10, random.uniform(-7, 1));
    const Eigen::Vector3d p =
        middle +
        away * Eigen::Vector3d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    const ShellBinding b = binder.bind(p);
    const double h = b.height_mm + random.uniform(-kRounding_mm, kRounding_mm);
    const Eigen::Vector2d at = barycentric_at_height(matrices[b.face], h, p);
    const double off_mm = (shell_point(matrices[b.face], at.x(), at.y(), h) - p).norm();
    EXPECT_TRUE(off_mm < 10 * kRounding_mm || away < 0.5)
        << off_mm << " mm off, " << away << " mm from the middle: well above where prisms close";
    EXPECT_EQ(binder.gives_back(b.face, h, p, 10 * kRounding_mm), off_mm <= 10 * kRounding_mm);
  }
}

TEST(ShellMap, TheNearestOfTwoPrismsWins) {
  // Two sheets 10 mm apart: a point 1 mm inside the lower one lies in the prisms of both.
  const Shell shell(box_mesh({100, 100, 10}));
  const ShellBinder binder(shell.proxy, 20);
  const ShellBinding b = binder.bind({50, 40, 1});
  EXPECT_NEAR(face_normal(shell.proxy, b.face).z(), -1, 1e-9);
  // A box's corner normals lean by acos(1/√3), so h counts √3 per millimetre of depth.
  EXPECT_NEAR(b.height_mm, -std::sqrt(3.0), kExactMm);
}

TEST(ShellMap, FollowsARigidMotionExactly) {
  const Shell shell(lumpy_mesh(50, 1));
  TriangleMesh moved = shell.proxy;
  const Eigen::Matrix3d rotation =
      Eigen::AngleAxisd(0.8, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  for (auto& v : moved.vertices) v = rotation * v + Eigen::Vector3d(5, -7, 9);
  const Shell after(moved);
  const ShellBinder binder(shell.proxy, 15);
  for (const auto& p : lumpy_mesh(52, 2).vertices) {
    const Eigen::Vector3d expected = rotation * p + Eigen::Vector3d(5, -7, 9);
    EXPECT_LT((after.point(binder.bind(p)) - expected).norm(), kExactMm);
  }
}

// Rows of points near and far, over smooth, folded and damaged proxies, of every length: four at a
// time find what one at a time does.
TEST(ShellMap, ManyPointsAreBoundAsEachAlone) {
  TriangleMesh folded = lumpy_mesh(50, 1);
  for (auto& v : folded.vertices) v.z() = std::abs(v.z());
  TriangleMesh damaged = lumpy_mesh(50, 1);
  damaged.faces.push_back({0, 0, 1});
  RandomStream random(11);
  for (const TriangleMesh& proxy : {lumpy_mesh(50, 1), lumpy_mesh(50, 3), folded, damaged}) {
    const ShellBinder binder(proxy, 25);  // reaches prisms whose cubics have several roots
    for (const double step_mm : {0.05, 0.4, 3.0}) {
      std::vector<Eigen::Vector3d> points;
      for (int row = 0; row < 300; ++row) {
        const Eigen::Vector3d from(random.uniform(-60, 60), random.uniform(-60, 60),
                                   random.uniform(-60, 60));
        const Eigen::Vector3d along =
            step_mm * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
        const int length = 1 + int(random.below(17));
        for (int k = 0; k < length; ++k) points.push_back(from + k * along);
      }
      points.push_back(Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
      std::vector<ShellBinding> together(points.size());
      binder.bind(points, together);
      for (std::size_t i = 0; i + 1 < points.size(); ++i) {
        const ShellBinding alone = binder.bind(points[i]);
        EXPECT_NEAR(std::abs(alone.height_mm), std::abs(together[i].height_mm), kExactMm);
        EXPECT_EQ(binder.inside(alone, points[i]), binder.inside(together[i], points[i]));
        if (alone.face != together[i].face) continue;  // on a wall, or a tie
        EXPECT_NEAR(alone.b1, together[i].b1, 1e-6);
        EXPECT_NEAR(alone.b2, together[i].b2, 1e-6);
      }
    }
  }
}

TEST(ShellBinder, RefusesWhatCannotCarryAnything) {
  EXPECT_THROW(ShellBinder(TriangleMesh{}, 1), BadDataError);
  TriangleMesh flat = tetrahedron_mesh();
  for (auto& v : flat.vertices) v.setZero();
  EXPECT_THROW(ShellBinder(flat, 1), BadDataError);
  EXPECT_THROW(ShellBinder(tetrahedron_mesh(), 0), BadDataError);
  EXPECT_THROW(ShellBinder(tetrahedron_mesh(), std::numeric_limits<double>::quiet_NaN()),
               BadDataError);
}

TEST(ShellBinder, UsesWhatIsLeftOfADamagedProxy) {
  TriangleMesh proxy = lumpy_mesh(50, 1);
  proxy.faces.push_back({0, 0, 1});  // naive clustering leaves such faces
  const ShellBinder binder(proxy, 10);
  EXPECT_LT(binder.bind({0, 0, 50}).face, proxy.faces.size() - 1);
}

}  // namespace
}  // namespace organbake
