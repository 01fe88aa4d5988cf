// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/capture/capture.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/core/random.h"
#include "organbake/geometry/mesh_edges.h"
#include "organbake/geometry/shell_binder.h"
#include "organbake/geometry/shell_surface.h"
#include "unit/capture/scenes.h"

namespace organbake {
namespace {

using Eigen::Vector3d;
using Motion = std::function<Vector3d(const Vector3d&)>;

constexpr double kExactShare = 1e-9;  // of the size: what rounding may leave of rigid motions

std::vector<Vector3d> moved(std::vector<Vector3d> points, const Motion& to) {
  for (Vector3d& p : points) p = to(p);
  return points;
}

Motion dent(const Vector3d& at, const Vector3d& into, double sigma_mm) {
  return [=](const Vector3d& p) -> Vector3d {
    return p + sigma_mm * std::exp(-(p - at).squaredNorm() / (2 * sigma_mm * sigma_mm)) * into;
  };
}

// Points of a surface as something below them carries them.
class Carried {
 public:
  Carried(const TriangleMesh& surface, ShellSurface shell)
      : shell_(std::move(shell)), at_rest_(surface.vertices) {
    const ShellBinder binder(shell_.at_rest(), shell_.reach_mm());
    for (const Vector3d& p : at_rest_) bindings_.push_back(binder.bind(p));
  }
  // RMS of the distance between where the points come and where they should, of those that the
  // motion moves.
  double rms_error_mm(const Motion& motion) const {
    const std::vector<ShellMatrix> shells =
        shell_.posed_matrices(moved(shell_.proxy().vertices, motion));
    double sum = 0, count = 0;
    for (std::size_t i = 0; i < at_rest_.size(); ++i) {
      const Vector3d should = motion(at_rest_[i]);
      if ((should - at_rest_[i]).norm() < 0.1) continue;
      const ShellBinding& b = bindings_[i];
      const Vector3d is = shell_point(shells[b.face], b.b1, b.b2, b.height_mm);
      sum += (is - should).squaredNorm(), ++count;
    }
    return count > 0 ? std::sqrt(sum / count) : 0;
  }

 private:
  ShellSurface shell_;
  std::vector<Vector3d> at_rest_;
  std::vector<ShellBinding> bindings_;
};

struct Body {
  const char* name;
  TriangleMesh surface, proxy;
};

TriangleMesh bent(TriangleMesh mesh, const Motion& motion) {
  mesh.vertices = moved(mesh.vertices, motion);
  return mesh;
}

// Closed and open ones, needles, sheets, pairs, and proxies of a handful of faces.
std::vector<Body> bodies() {
  const auto scaled = [](double x, double y, double z) {
    return [=](const Vector3d& p) -> Vector3d { return {x * p.x(), y * p.y(), z * p.z()}; };
  };
  TriangleMesh tetrahedron = bent(tetrahedron_mesh(), [](const Vector3d& p) -> Vector3d {
    return 120 * (p - Vector3d::Constant(0.25));
  });
  return {
      {"organ", lumpy_mesh(40, 5), lumpy_mesh(40, 1)},
      {"4 faces", sphere_mesh(30, 4), tetrahedron},
      {"20 faces", lumpy_mesh(40, 4), lumpy_mesh(40, 0)},
      {"fine proxy", lumpy_mesh(40, 4), lumpy_mesh(40, 4)},
      {"needle", bent(sphere_mesh(1, 4), scaled(2, 2, 80)),
       bent(sphere_mesh(1, 2), scaled(2, 2, 80))},
      {"sheet", grid_box({80, 80, 1}, 24), grid_box({80, 80, 1}, 6)},
      {"open", square_at({0, 0, 0}, {0, 0, 1}, 40, 20), square_at({0, 0, 0}, {0, 0, 1}, 40, 4)},
      {"two", joined(moved(sphere_mesh(30, 4), {-40, 0, 0}), moved(sphere_mesh(30, 4), {25, 0, 0})),
       joined(moved(sphere_mesh(30, 1), {-40, 0, 0}), moved(sphere_mesh(30, 1), {25, 0, 0}))},
  };
}

TEST(SmoothSkinBake, RestRigidAndAffineMotionsAreExact) {
  Eigen::Matrix3d shear = Eigen::Matrix3d::Identity();
  shear(0, 1) = 0.6, shear(2, 0) = -0.4, shear(1, 1) = 1.7;
  const Eigen::AngleAxisd turn(2.5, Vector3d(1, 2, -1).normalized());
  for (const Body& body : bodies()) {
    const ShellSurface shell(body.proxy, bake_smooth_skin(body.surface, body.proxy, 5));
    const double size_mm = bounds(body.proxy).diagonal();
    for (const Motion& motion :
         {Motion([](const Vector3d& p) { return p; }),
          Motion([&](const Vector3d& p) -> Vector3d { return turn * p + Vector3d(300, 0, -80); }),
          Motion([&](const Vector3d& p) -> Vector3d { return shear * p; })}) {
      const TriangleMesh posed = shell.posed(moved(body.proxy.vertices, motion));
      for (std::size_t n = 0; n < posed.vertices.size(); ++n)
        ASSERT_LT((posed.vertices[n] - motion(shell.at_rest().vertices[n])).norm(),
                  kExactShare * size_mm)
            << body.name;
    }
  }
}

TEST(SmoothSkinBake, LiesOnTheSurface) {
  const TriangleMesh surface = lumpy_mesh(40, 5), proxy = lumpy_mesh(40, 2);
  const RayScene scene(surface);
  const auto farthest = [&](const TriangleMesh& mesh) {
    double far = 0;
    for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
      const auto [a, b, c] = mesh.faces[f];
      const Vector3d middle = (mesh.vertices[a] + mesh.vertices[b] + mesh.vertices[c]) / 3;
      far = std::max(far, scene.closest_point(middle).distance_mm);
    }
    return far;
  };
  const ShellSurface shell(proxy, bake_smooth_skin(surface, proxy, 4));
  EXPECT_LT(farthest(shell.at_rest()), 0.5 * farthest(proxy));
}

// A sphere's skin is as round over the proxy's edges as between them, at rest and in a dent.
TEST(SmoothSkinBake, NoCreaseLiesOverTheProxysEdges) {
  static constexpr double kRadius_mm = 40;
  const TriangleMesh surface = sphere_mesh(kRadius_mm, 5), proxy = sphere_mesh(kRadius_mm, 1);
  const ShellSurface shell(proxy, bake_smooth_skin(surface, proxy, 5));
  const auto onto_sphere = [](const Vector3d& p) -> Vector3d {
    return kRadius_mm * p.normalized();
  };
  const Vector3d into = Vector3d(-1, -0.2, -0.3).normalized();
  for (const Motion& motion :
       {Motion([](const Vector3d& p) { return p; }), dent(-kRadius_mm * into, into, 20)}) {
    const TriangleMesh is = shell.posed(moved(proxy.vertices, motion));
    const TriangleMesh should = bent(bent(shell.at_rest(), onto_sphere), motion);
    std::vector<double> beyond_deg;
    MeshEdges(is).for_each([&](std::span<const EdgeUse> uses) {
      const auto fold_deg = [&](const TriangleMesh& mesh) {
        const Vector3d one = face_normal(mesh, uses[0].face()).normalized(),
                       other = face_normal(mesh, uses[1].face()).normalized();
        return one.cross(other).norm() * 180 / std::numbers::pi;
      };
      beyond_deg.push_back(fold_deg(is) - fold_deg(should));
    });
    std::sort(beyond_deg.begin(), beyond_deg.end());
    EXPECT_LT(beyond_deg[beyond_deg.size() * 99 / 100], 4);
  }
}

// The figures of an icosphere's 320 faces, half of whose edge is the dent's sigma: what the plates
// reach with room for another compiler's rounding. The prism is 4 times as far off.
TEST(SmoothSkinBake, ASmoothDentIsFollowedFarBetterThanByPrisms) {
  const TriangleMesh surface = lumpy_mesh(40, 5), proxy = lumpy_mesh(40, 2);
  const Carried prism(surface, ShellSurface(proxy));
  const Carried skin(surface, ShellSurface(proxy, bake_smooth_skin(surface, proxy, 4)));
  for (const Vector3d& way :
       {Vector3d(1, 0.2, 0.3), Vector3d(-0.3, 1, 0.1), Vector3d(0, -0.4, -1)}) {
    const Vector3d into = -way.normalized();
    const Motion motion = dent(-40 * into, into, 15);
    EXPECT_LT(skin.rms_error_mm(motion), 0.35 * prism.rms_error_mm(motion));
  }
}

// Whatever the body and however violent the motion, the skin is never much worse than prisms.
TEST(SmoothSkinBake, IsNeverMuchWorseThanPrisms) {
  // Four vertices tell of affine motions only, whatever lies between: twists are lost on both.
  const auto worse = [](const Body& body) { return body.proxy.faces.size() == 4 ? 1.1 : 1.05; };
  constexpr double kNothing_mm = 0.02;  // where both are as good as exact
  RandomStream random(5);
  for (const Body& body : bodies()) {
    const SmoothSkin skin = bake_smooth_skin(body.surface, body.proxy, 5);
    const Carried prism(body.surface, ShellSurface(body.proxy));
    const Carried smooth(body.surface, ShellSurface(body.proxy, skin));
    const double size_mm = bounds(body.proxy).diagonal();
    for (int trial = 0; trial < 8; ++trial) {
      const Vector3d at = body.surface.vertices[random.below(body.surface.vertices.size())];
      const Vector3d into =
          Vector3d(random.normal(), random.normal(), random.normal()).normalized();
      const double sigma_mm = size_mm * random.uniform(0.15, 0.3);
      const double pitch = random.uniform(1, 3.14) / size_mm;
      const Motion twist = [=](const Vector3d& p) -> Vector3d {
        return Eigen::AngleAxisd(pitch * p.dot(into), into) * p;
      };
      for (const Motion& motion : {dent(at, into, sigma_mm), twist}) {
        EXPECT_LT(smooth.rms_error_mm(motion),
                  worse(body) * prism.rms_error_mm(motion) + kNothing_mm)
            << body.name << ", trial " << trial;
      }
    }
  }
}

// A sheet of 1 mm, its upper side pushed up: the lower one stays.
TEST(SmoothSkinBake, TheOtherSideOfASheetDoesNotFollow) {
  const TriangleMesh surface = grid_box({80, 80, 1}, 24), proxy = grid_box({80, 80, 1}, 6);
  const ShellSurface shell(proxy, bake_smooth_skin(surface, proxy, 4));
  const auto upper_side = [](const Vector3d& p) -> Vector3d {
    const double r = p.head<2>().norm();
    return p.z() > 0 ? Vector3d(p + 10 * std::exp(-r * r / 200) * Vector3d::UnitZ()) : p;
  };
  const TriangleMesh posed = shell.posed(moved(proxy.vertices, upper_side));
  double raised_mm = 0;
  for (std::size_t n = 0; n < posed.vertices.size(); ++n) {
    const Vector3d& at = shell.at_rest().vertices[n];
    const double up_mm = (posed.vertices[n] - at).norm();
    if (at.head<2>().norm() > 25) continue;  // the rim, where sides meet
    if (at.z() < 0) {
      EXPECT_LT(up_mm, 0.1);
    }
    raised_mm = std::max(raised_mm, up_mm);
  }
  EXPECT_GT(raised_mm, 9);
}

TEST(SmoothSkinBake, SeparateBodiesDoNotFollowOneAnother) {
  const TriangleMesh surface =
      joined(moved(sphere_mesh(30, 4), {-33, 0, 0}), moved(sphere_mesh(30, 4), {33, 0, 0}));
  const TriangleMesh proxy =
      joined(moved(sphere_mesh(30, 1), {-33, 0, 0}), moved(sphere_mesh(30, 1), {33, 0, 0}));
  const SmoothSkin skin = bake_smooth_skin(surface, proxy, 4);
  const TriangleMesh mesh = smooth_skin_mesh(proxy, skin);
  for (std::size_t n = 0; n < skin.node_count(); ++n) {
    for (std::uint32_t k = skin.first[n]; k < skin.first[n + 1]; ++k)
      ASSERT_GT(mesh.vertices[n].x() * proxy.vertices[skin.carrier[k]].x(), 0);
  }
}

TEST(SmoothSkinBake, IsTheSameForAnyNumberOfThreads) {
  const TriangleMesh surface = lumpy_mesh(40, 4), proxy = lumpy_mesh(40, 1);
  const SmoothSkin many = bake_smooth_skin(surface, proxy, 3);
  const ThreadLimit one(1);
  const SmoothSkin alone = bake_smooth_skin(surface, proxy, 3);
  EXPECT_EQ(many.carrier, alone.carrier);
  EXPECT_EQ(many.weight, alone.weight);
}

TEST(SmoothSkinBake, WrongInputsAreRefused) {
  const TriangleMesh mesh = lumpy_mesh(40, 1);
  EXPECT_THROW(bake_smooth_skin(mesh, mesh, 0), UsageError);
  EXPECT_THROW(bake_smooth_skin(mesh, mesh, std::nan("")), UsageError);
  EXPECT_THROW(bake_smooth_skin(TriangleMesh(), mesh, 5), BadDataError);
  EXPECT_THROW(bake_smooth_skin(mesh, {}, 5), BadDataError);
}

}  // namespace
}  // namespace organbake
