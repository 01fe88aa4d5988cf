// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/mechanics/spring_fit.h"

#include <gtest/gtest.h>

#include "organbake/core/error.h"
#include "organbake/deform/deformer.h"
#include "organbake/mechanics/dead_loads.h"
#include "organbake/mechanics/linear_statics.h"
#include "organbake/mechanics/mechanics.h"
#include "support/meshes.h"

namespace organbake {
namespace {

MechanicsModel model_of(const TriangleMesh& proxy) {
  MechanicsOptions options;
  options.fem = true;
  return make_mechanics(proxy, options);
}

// Where the player's tissue comes to stand under a dead load, mm from rest.
Eigen::VectorXd player_shape(const TriangleMesh& proxy, const MechanicsModel& model,
                             TissueSolver solver, const Eigen::VectorXd& load_n) {
  DeformOptions options;
  options.solver = solver;
  Deformer deformer(proxy, model, {}, options);
  std::vector<Eigen::Vector3d> forces;
  for (Eigen::Index v = 0; v < load_n.size() / 3; ++v)
    forces.emplace_back(load_n.segment<3>(3 * v));
  deformer.set_load(forces);
  for (int step = 0; step < 600; ++step) deformer.step({});
  Eigen::VectorXd moved(load_n.size());
  for (std::size_t v = 0; v < proxy.vertices.size(); ++v) {
    moved.segment<3>(static_cast<Eigen::Index>(3 * v)) =
        deformer.positions()[v] - proxy.vertices[v];
  }
  return moved;
}

TEST(PatchLoads, PushWithANewtonAndKeepSomePatchesOut) {
  const TriangleMesh proxy = lumpy_mesh(50, 1);
  const DeadLoads loads = patch_loads(proxy, {0, 1, 2});
  EXPECT_EQ(loads.fitted.cols() + loads.held_out.cols(), 3 * 39);
  EXPECT_EQ(loads.held_out.cols(), 3 * 13);
  for (Eigen::Index l = 0; l < loads.fitted.cols(); ++l) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (Eigen::Index v = 0; v < 42; ++v) sum += loads.fitted.block<3, 1>(3 * v, l);
    EXPECT_NEAR(sum.norm(), 1, 1e-12);
    EXPECT_EQ(loads.fitted.block(0, l, 9, 1).norm(), 0) << "anchors bear nothing";
  }
}

// A load that hardly bends the tissue: both of the player's solvers come to stand where the linear
// models say.
TEST(LinearStatics, IsWhatThePlayersSolversComeTo) {
  constexpr double kRelative = 0.01;
  constexpr double kSmall_n = 1e-3;
  const TriangleMesh proxy = lumpy_mesh(50, 1);
  const MechanicsModel model = model_of(proxy);
  const Eigen::MatrixXd load = kSmall_n * patch_loads(proxy, model.anchors).fitted.col(4);
  const Eigen::VectorXd fem = fem_displacements(model, load);
  const LinearSprings springs(proxy, model);
  const Eigen::VectorXd spring_shape =
      springs.all_rows(springs.compliance(Eigen::VectorXd::Ones(springs.stretch().cols())) *
                       springs.free_rows(load));
  EXPECT_LT((player_shape(proxy, model, TissueSolver::fem, load) - fem).norm(),
            kRelative * fem.norm());
  EXPECT_LT((player_shape(proxy, model, TissueSolver::springs, load) - spring_shape).norm(),
            kRelative * spring_shape.norm());
}

// Maxwell & Betti: what one load does at another's place, the other does at its.
TEST(LinearStatics, IsReciprocal) {
  const TriangleMesh proxy = lumpy_mesh(50, 1);
  const MechanicsModel model = model_of(proxy);
  const Eigen::MatrixXd loads = patch_loads(proxy, model.anchors).fitted.leftCols(9);
  const Eigen::MatrixXd work = loads.transpose() * fem_displacements(model, loads);
  EXPECT_LT((work - work.transpose()).norm(), 1e-9 * work.norm());
  EXPECT_GT(work.diagonal().minCoeff(), 0);
}

TEST(SpringFit, BringsTheSpringsNearTheElements) {
  const TriangleMesh proxy = lumpy_mesh(50, 1);
  MechanicsModel model = model_of(proxy);
  const SpringFitReport report = fit_springs_to_fem(proxy, model);
  EXPECT_GT(report.fitted_before, 0.5) << "formulas are that far off";
  EXPECT_LT(report.fitted, 0.15);
  EXPECT_LT(report.held_out, 0.25);
  for (const Spring& s : model.springs) {
    EXPECT_GT(s.stiffness_n_per_mm, 0);
    EXPECT_GT(s.damping_n_s_per_mm, 0);
  }
  // The player's springs, held by what was fitted, come to stand near the elements.
  const Eigen::MatrixXd load = 1e-3 * patch_loads(proxy, model.anchors).held_out.col(3);
  const Eigen::VectorXd fem = fem_displacements(model, load);
  EXPECT_LT((player_shape(proxy, model, TissueSolver::springs, load) - fem).norm(),
            0.4 * fem.norm());
}

TEST(SpringFit, StiffTissueGetsStiffSprings) {
  const TriangleMesh proxy = lumpy_mesh(50, 0);
  MechanicsOptions options;
  options.fem = options.fit_to_fem = true;
  const MechanicsModel soft = make_mechanics(proxy, options);
  options.young_modulus_kpa *= 7;
  const MechanicsModel stiff = make_mechanics(proxy, options);
  ASSERT_EQ(soft.springs.size(), stiff.springs.size());
  const Eigen::MatrixXd load = patch_loads(proxy, soft.anchors).fitted.leftCols(5);
  EXPECT_NEAR(spring_error(proxy, soft, load), spring_error(proxy, stiff, load), 0.01);
  for (std::size_t s = 0; s < soft.springs.size(); ++s)
    EXPECT_NEAR(stiff.springs[s].stiffness_n_per_mm / soft.springs[s].stiffness_n_per_mm, 7, 0.2);
}

TEST(SpringFit, NeedsTetrahedra) {
  const TriangleMesh proxy = lumpy_mesh(50, 1);
  MechanicsModel model = make_mechanics(proxy, {});
  EXPECT_THROW(fit_springs_to_fem(proxy, model), BadDataError);
  MechanicsOptions options;
  options.fit_to_fem = true;
  EXPECT_THROW(options.check(), UsageError);
}

}  // namespace
}  // namespace organbake
