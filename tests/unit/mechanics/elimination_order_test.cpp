// SPDX-License-Identifier: GPL-3.0-or-later
#include "elimination_order.h"

#include <gtest/gtest.h>

#include <Eigen/SparseCholesky>
#include <algorithm>

#include "organbake/deform/deformer.h"
#include "organbake/mechanics/mechanics.h"
#include "support/meshes.h"

namespace organbake {
namespace {

// A net large enough for nested dissection, made once.
const TriangleMesh& large_proxy() {
  static const TriangleMesh proxy = lumpy_mesh(50, 5);
  return proxy;
}
const MechanicsModel& large_model() {
  static const MechanicsModel model = make_mechanics(large_proxy(), {});
  return model;
}

using Matrix = Eigen::SparseMatrix<double>;

// Entries of the factor of masses and springs when vertices are numbered as given.
template <class Ordering>
Eigen::Index fill(const MechanicsModel& model, const std::vector<std::uint32_t>& vertices) {
  std::vector<int> column(model.mass_kg.size(), -1);
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < static_cast<int>(vertices.size()); ++i) {
    column[vertices[i]] = i;
    entries.emplace_back(i, i, 100);
  }
  for (const Spring& s : model.springs) {
    const auto [low, high] = std::minmax(column[s.a], column[s.b]);
    if (low >= 0) entries.emplace_back(high, low, -1);
  }
  const auto n = static_cast<Eigen::Index>(vertices.size());
  Matrix matrix(n, n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Matrix, Eigen::Lower, Ordering> factor(matrix);
  return factor.matrixL().nestedExpression().nonZeros();
}

TEST(EliminationOrder, NamesEachFreeVertexOfALargeNetOnce) {
  std::vector<std::uint32_t> all = large_model().elimination_order;
  EXPECT_FALSE(all.empty());
  all.insert(all.end(), large_model().anchors.begin(), large_model().anchors.end());
  std::sort(all.begin(), all.end());
  ASSERT_EQ(all.size(), large_proxy().vertices.size());
  for (std::uint32_t v = 0; v < all.size(); ++v) ASSERT_EQ(all[v], v);
}

TEST(EliminationOrder, LeavesALargeNetsFactorSparserThanThePlayersOwn) {
  const std::vector<std::uint32_t>& order = large_model().elimination_order;
  const auto dissected = fill<Eigen::NaturalOrdering<int>>(large_model(), order);
  const auto by_degree = fill<Eigen::AMDOrdering<int>>(large_model(), order);
  EXPECT_LT(static_cast<double>(dissected), 0.8 * static_cast<double>(by_degree));
}

TEST(EliminationOrder, IsLeftToThePlayerForSmallNets) {
  EXPECT_TRUE(make_mechanics(lumpy_mesh(50, 2), {}).elimination_order.empty());
  MechanicsModel anchored;
  anchored.mass_kg = {1, 1};
  anchored.anchors = {0, 1};
  EXPECT_TRUE(elimination_order(anchored).empty());
}

TEST(EliminationOrder, ChangesNothingButRounding) {
  MechanicsModel without = large_model();
  without.elimination_order.clear();
  Deformer ordered(large_proxy(), large_model(), {}, {}), searching(large_proxy(), without, {}, {});
  Instrument tip;
  tip.active = true;
  for (int step = 0; step < 10; ++step) {
    tip.position_mm = {0, -57 + 2.0 * step, 0};
    ordered.step({tip});
    searching.step({tip});
  }
  double pressed_mm = 0, apart_mm = 0;
  for (std::size_t v = 0; v < large_proxy().vertices.size(); ++v) {
    const Eigen::Vector3d& at = ordered.positions()[v];
    pressed_mm = std::max(pressed_mm, (at - large_proxy().vertices[v]).norm());
    apart_mm = std::max(apart_mm, (at - searching.positions()[v]).norm());
  }
  EXPECT_GT(pressed_mm, 5);
  // Far below a contact's tolerance (0.02 mm): the factor is kept in single precision.
  EXPECT_LT(apart_mm, 2e-3);
}

}  // namespace
}  // namespace organbake
