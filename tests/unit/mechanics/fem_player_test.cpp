// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>

#include "organbake/deform/deformer.h"
#include "organbake/mechanics/mechanics.h"
#include "support/meshes.h"

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

}  // namespace
}  // namespace organbake
