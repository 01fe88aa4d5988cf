// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>

#include "organbake/deform/deformer.h"
#include "organbake/mechanics/mechanics.h"
#include "support/meshes.h"
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

TEST_F(BakedBody, GivesWayUnderATipAndComesBack) {
  Deformer deformer(proxy, model, {}, options);
  StepReport report;
  for (int step = 0; step < 120; ++step) {
    report = deformer.step({poke({0, -57 + std::min(20.0, 0.3 * step), 0})});
    ASSERT_FALSE(report.recovered);
  }
  EXPECT_GT(report.contacts, 0u);
  EXPECT_LT(report.penetration_mm, 0.1);
  EXPECT_LT(report.tip_force_n.at(0).y(), -0.1);
  for (const std::uint32_t a : model.anchors) {
    EXPECT_TRUE(deformer.positions()[a] == proxy.vertices[a]) << "anchors don't move";
  }
  for (int step = 0; step < 2000; ++step) deformer.step({});
  EXPECT_TRUE(deformer.positions() == proxy.vertices);
}

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

TEST_F(BakedBody, DeepPokesFromAllSidesDoNotBlowUp) {
  for (const double rate : {240.0, 15.0}) {
    options.time_step_s = 1 / rate;
    Deformer deformer(proxy, model, {}, options);
    for (const Vector3d& from :
         {Vector3d(0, -1, 0), Vector3d(1, 0, 0), Vector3d(-0.6, -0.5, 0.6)}) {
      const int steps = static_cast<int>(rate / 2);
      for (int step = 0; step <= steps; ++step) {
        const StepReport report =
            deformer.step({poke((60 - 55.0 * step / steps) * from.normalized())});
        ASSERT_FALSE(report.recovered);
        for (std::size_t v = 0; v < proxy.vertices.size(); ++v)
          ASSERT_LT((deformer.positions()[v] - proxy.vertices[v]).norm(), 100);
      }
      deformer.step({});
    }
  }
}

// A newton on one vertex of a proxy.
Eigen::MatrixXd newton_on(const TriangleMesh& proxy, std::size_t vertex, const Vector3d& along) {
  Eigen::MatrixXd load =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(3 * proxy.vertices.size()), 1);
  load.middleRows<3>(static_cast<Eigen::Index>(3 * vertex)) = along.normalized();
  return load;
}

struct Hold {
  int iterations, steps;
};

// Where the player's elements stand after so many steps under a dead load, mm from rest.
Eigen::VectorXd held_shape(const TriangleMesh& proxy, const MechanicsModel& model,
                           const Eigen::VectorXd& load_n, const Hold& hold) {
  DeformOptions options;
  options.solver = TissueSolver::fem;
  options.iterations = hold.iterations;
  Deformer deformer(proxy, model, {}, options);
  std::vector<Vector3d> forces;
  for (Eigen::Index v = 0; v < load_n.size() / 3; ++v)
    forces.emplace_back(load_n.segment<3>(3 * v));
  deformer.set_load(forces);
  for (int step = 0; step < hold.steps; ++step) deformer.step({});
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
  EXPECT_LT((held_shape(proxy, model, load, {60, 600}) - linear).norm(), kRelative * linear.norm());
}

// Two seconds of the player's few iterations are nearly as good as many more of many.
TEST_F(BakedBody, IsNearItsConvergedShapeSoon) {
  constexpr double kRelative = 0.02;
  const std::size_t front = front_vertex(proxy);
  Eigen::MatrixXd load = newton_on(proxy, front, {0, 1, 0});
  const Eigen::VectorXd linear = fem_displacements(model, load);
  load *= 10 / linear.segment<3>(static_cast<Eigen::Index>(3 * front)).norm();  // 10 mm deep
  const Eigen::VectorXd converged = held_shape(proxy, model, load, {60, 1200});
  const Eigen::VectorXd soon = held_shape(proxy, model, load, {DeformOptions{}.iterations, 120});
  EXPECT_LT((soon - converged).norm(), kRelative * converged.norm());
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
