// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/capture/capture.h"

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/core/random.h"
#include "organbake/geometry/mesh_edges.h"
#include "organbake/geometry/shell.h"
#include "organbake/geometry/smooth_skin.h"
#include "support/testing.h"
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

struct Node {
  std::uint32_t face;
  std::size_t index;
  Vector3d point;
};

std::vector<Node> nodes_of(const BaseLayer& base, const TriangleMesh& proxy) {
  const std::vector<Vector3d> normals = vertex_normals(proxy);
  std::vector<Node> nodes;
  for (std::uint32_t f = 0; f < base.face_count; ++f) {
    const ShellMatrix shell = shell_matrix(proxy, normals, f);
    for (std::uint32_t i = 0; i <= base.steps; ++i)
      for (std::uint32_t j = 0; i + j <= base.steps; ++j) {
        const std::size_t index =
            std::size_t(f) * base.nodes_per_face() + base_node_index(base.steps, i, j);
        const double b1 = double(i) / base.steps, b2 = double(j) / base.steps;
        nodes.push_back({f, index, shell_point(shell, b1, b2, base.height_mm[index])});
      }
  }
  return nodes;
}

struct Baked {
  TriangleMesh surface, proxy;
  std::vector<PosedCamera> cameras;
  BaseLayer base;
};

Baked bake(const TriangleMesh& surface, const TriangleMesh& proxy) {
  Baked baked{
      surface,
      proxy,
      {plain_camera({0, -160, 0}, {0, 0, 0}, 200), plain_camera({0, 160, 0}, {0, 0, 0}, 200)},
      {}};
  CaptureOptions options;
  options.base_step_mm = 3;
  baked.base = capture(surface, proxy, baked.cameras, *make_material_color({}), options).base;
  return baked;
}

TEST(BaseLayer, NodesLieOnTheSurface) {
  const Baked baked = bake(lumpy_mesh(40, 5), lumpy_mesh(40, 1));
  EXPECT_EQ(baked.base.face_count, 80u);
  EXPECT_GT(baked.base.steps, 4u);
  const RayScene scene(baked.surface);
  for (const Node& node : nodes_of(baked.base, baked.proxy))
    EXPECT_LT(scene.closest_point(node.point).distance_mm, 1e-4);  // heights are floats
}

TEST(BaseLayer, SharedNodesAreIdentical) {
  const Baked baked = bake(lumpy_mesh(40, 5), lumpy_mesh(40, 1));
  const BaseLayer& base = baked.base;
  const Lattice lattice(baked.proxy, base.steps);
  std::map<std::uint32_t, std::size_t> first;
  std::size_t shared = 0;
  for (std::uint32_t f = 0; f < base.face_count; ++f)
    for (std::uint32_t i = 0; i <= base.steps; ++i)
      for (std::uint32_t j = 0; i + j <= base.steps; ++j) {
        const std::size_t index =
            std::size_t(f) * base.nodes_per_face() + base_node_index(base.steps, i, j);
        const auto [known, is_new] = first.try_emplace(lattice.node(f, i, j), index);
        if (is_new) continue;
        ++shared;
        EXPECT_EQ(base.height_mm[index], base.height_mm[known->second]);
        EXPECT_EQ(base.color[index], base.color[known->second]);
        EXPECT_EQ(base.seen_by[index], base.seen_by[known->second]);
      }
  EXPECT_GT(shared, 80u * 3 * base.steps / 2);
}

TEST(BaseLayer, KnowsWhoSeesIt) {
  const Baked baked = bake(sphere_mesh(40, 5), sphere_mesh(40, 1));
  int front = 0, both = 0;
  for (const Node& node : nodes_of(baked.base, baked.proxy)) {
    const std::uint32_t seen = baked.base.seen_by[node.index];
    EXPECT_LT(seen, 4u) << "there are two cameras";
    const double facing = -node.point.normalized().y();
    if (facing > 0.75) {
      EXPECT_EQ(seen, 1u);
    }
    if (facing < -0.75) {
      EXPECT_EQ(seen, 2u);
    }
    if (std::abs(facing) < 0.2) {
      EXPECT_EQ(seen, 0u) << "too steep for either";
    }
    front += seen & 1;
    both += seen == 3;
  }
  EXPECT_GT(front, 100);
  EXPECT_EQ(both, 0);
}

// The surface passes through the proxy's very vertices: heights are zero, not the far wall's.
TEST(BaseLayer, AProxyThatIsTheSurfaceHasHeightZero) {
  const TriangleMesh mesh = lumpy_mesh(40, 2);
  const Baked baked = bake(mesh, mesh);
  for (const float height : baked.base.height_mm) EXPECT_NEAR(height, 0, 1e-4);
}

// Nodes over a missing half of the surface find nothing on their lines.
TEST(BaseLayer, NodesWithoutASurfaceTakeTheNearest) {
  TriangleMesh half = sphere_mesh(40, 4);
  std::erase_if(half.faces, [&](const Face& f) { return half.vertices[f[0]].y() > 0; });
  const Baked baked = bake(half, sphere_mesh(38, 1));
  for (std::size_t i = 0; i < baked.base.height_mm.size(); ++i) {
    EXPECT_TRUE(std::isfinite(baked.base.height_mm[i]));
    EXPECT_LT(std::abs(baked.base.height_mm[i]), 80);
    EXPECT_TRUE(baked.base.color[i].allFinite());
    EXPECT_GT(baked.base.color[i].maxCoeff(), 0);
  }
}

}  // namespace
}  // namespace organbake
