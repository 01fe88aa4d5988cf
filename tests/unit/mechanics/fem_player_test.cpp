// SPDX-License-Identifier: GPL-3.0-or-later

#include "organbake/deform/deformer.h"
#include "organbake/mechanics/mechanics.h"
#include "support/meshes.h"
#include "support/testing.h"
#include "tissue_parts.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

// What the baker makes is what the player's solver can use: a proxy inside lattice cells.
class BakedBody : public testing::Test {
 protected:
  BakedBody() {
    MechanicsOptions mechanics;
    mechanics.fem = true;
    model = make_mechanics(proxy, mechanics);
    options.solver = TissueSolver::fem;
  }

  static Instrument poke(const Vector3d& at) {
    Instrument tip;
    tip.active = true;
    tip.position_mm = at;
    return tip;
  }

  TriangleMesh proxy = lumpy_mesh(50, 1);
  MechanicsModel model;
  DeformOptions options;
};

// The paper: springs and finite elements can be exchanged. The same poke feels alike.
TEST_F(BakedBody, FeelsLikeTheSprings) {
  const auto force_n = [&](TissueSolver solver) {
    options.solver = solver;
    Deformer deformer(proxy, model, {}, options);
    StepReport report;
    for (int step = 0; step < 240; ++step)
      report = deformer.step({poke({0, -57 + std::min(12.0, 0.3 * step), 0})});
    return report.tip_force_n.at(0).norm();
  };
  const double fem = force_n(TissueSolver::fem), springs = force_n(TissueSolver::springs);
  EXPECT_GT(fem, springs / 4);
  EXPECT_LT(fem, springs * 4);
}

// A newton on one vertex of a proxy.
Eigen::MatrixXd newton_on(const TriangleMesh& proxy, std::size_t vertex, const Vector3d& along) {
  Eigen::MatrixXd load =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(3 * proxy.vertices.size()), 1);
  load.middleRows<3>(static_cast<Eigen::Index>(3 * vertex)) = along.normalized();
  return load;
}

// Where the player's elements come to stand under a dead load, mm from rest.
Eigen::VectorXd held_shape(const TriangleMesh& proxy, const MechanicsModel& model,
                           const Eigen::VectorXd& load_n) {
  DeformOptions options;
  options.solver = TissueSolver::fem;
  options.iterations = 60;
  Deformer deformer(proxy, model, {}, options);
  std::vector<Vector3d> forces;
  for (Eigen::Index v = 0; v < load_n.size() / 3; ++v)
    forces.emplace_back(load_n.segment<3>(3 * v));
  deformer.set_load(forces);
  for (int step = 0; step < 600; ++step) deformer.step({});
  Eigen::VectorXd moved(load_n.size());
  for (std::size_t v = 0; v < proxy.vertices.size(); ++v)
    moved.segment<3>(static_cast<Eigen::Index>(3 * v)) =
        deformer.positions()[v] - proxy.vertices[v];
  return moved;
}

// A vertex of the front, which no anchor is near.
std::size_t front_vertex(const TriangleMesh& proxy) {
  std::size_t front = 0;
  for (std::size_t v = 1; v < proxy.vertices.size(); ++v)
    if (proxy.vertices[v].y() < proxy.vertices[front].y()) front = v;
  return front;
}

// A load that hardly bends the tissue: the player's elements come to stand where linear elasticity
// says.
TEST_F(BakedBody, ComesToStandWhereLinearElasticitySays) {
  constexpr double kRelative = 0.01;  // the solver has not quite converged
  const Eigen::MatrixXd load = 1e-3 * newton_on(proxy, front_vertex(proxy), {0, 1, 0});
  const Eigen::VectorXd linear = fem_displacements(model, load);
  ASSERT_GT(linear.norm(), 0);
  EXPECT_LT((held_shape(proxy, model, load) - linear).norm(), kRelative * linear.norm());
}

// Maxwell & Betti: what one load does at another's place, the other does at its.
TEST_F(BakedBody, IsReciprocal) {
  Eigen::MatrixXd loads(static_cast<Eigen::Index>(3 * proxy.vertices.size()), 3);
  const std::size_t front = front_vertex(proxy);
  loads.col(0) = newton_on(proxy, front, {0, 1, 0});
  loads.col(1) = newton_on(proxy, (front + 7) % proxy.vertices.size(), {1, 0, 0});
  loads.col(2) = newton_on(proxy, (front + 13) % proxy.vertices.size(), {1, 1, 1});
  const Eigen::MatrixXd work = loads.transpose() * fem_displacements(model, loads);
  EXPECT_LT((work - work.transpose()).norm(), 1e-9 * work.norm());
  EXPECT_GT(work(0, 0), 0);
}

}  // namespace
}  // namespace organbake
