// SPDX-License-Identifier: Apache-2.0
#include "cutting/cut_organ.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <numeric>

#include "core/error.h"
#include "cutting/blade_sweeps.h"
#include "support/cut_bodies.h"
#include "support/meshes.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

// A box with tetrahedra of 10 mm, its skin the proxy itself; or a smaller one.
Bundle box_organ(double scale = 1) {
  Bundle bundle;
  bundle.manifest.name = "box";
  bundle.proxy = grid_box(scale * Vector3d(60, 40, 40), 8);
  bundle.mechanics.body = test::tissue_under(bundle.proxy, 10 * scale);
  bundle.mechanics.young_modulus_kpa = 10;
  bundle.mechanics.density_kg_per_m3 = 1000;
  return bundle;
}

// A blade, its edge upright, on its way at rest.
std::size_t draw_blade(BladeSweeps& sweeps, CutOrgan& organ, const Vector3d& from,
                       const Vector3d& to, double edge_mm, int steps = 40,
                       std::size_t instrument = 0) {
  std::size_t changes = 0;
  for (int i = 0; i <= steps; ++i) {
    const Vector3d tip = from + double(i) / steps * (to - from);
    const std::vector<Vector3d> nodes =
        organ.cut() ? organ.now().mechanics.body->nodes_mm : organ.body().uncut().nodes_mm;
    const BladeNow now{instrument, {tip, tip + Vector3d(0, 0, edge_mm)}};
    sweeps.advance({&now, 1}, organ, nodes);
    changes += organ.part(sweeps.sheet());
  }
  sweeps.advance({}, organ, {});
  return changes;
}

TEST(CutOrgan, OrgansWithoutTetrahedraAreRefused) {
  Bundle bundle = box_organ();
  bundle.mechanics.body.reset();
  try {
    CutOrgan organ(bundle);
    FAIL();
  } catch (const UsageError& error) {
    EXPECT_NE(std::string(error.what()).find("mechanics.fem=true"), std::string::npos);
  }
}

TEST(CutOrgan, ABladeInTheAirCutsNothing) {
  CutOrgan organ(box_organ());
  BladeSweeps sweeps(organ);
  EXPECT_EQ(draw_blade(sweeps, organ, {-50, 0, 21}, {50, 0, 21}, 30), 0u);
  EXPECT_FALSE(organ.cut());
}

// In two from end to end: two bodies, each with its share of the skin and a wall, closed to what a
// wall's quadrangles leave of its outline.
TEST(CutOrgan, ACutThroughMakesTwoBodies) {
  CutOrgan organ(box_organ());
  BladeSweeps sweeps(organ);
  EXPECT_GT(draw_blade(sweeps, organ, {3.3, -35, -30}, {3.3, 35, -30}, 60), 0u);
  ASSERT_TRUE(organ.cut());
  EXPECT_EQ(organ.body().cut().fragment_count(), 2u);
  const Bundle& now = organ.now();
  ASSERT_EQ(now.mechanics.body->vertices.size(), now.proxy.vertices.size());
  std::array<double, 2> volume{};
  for (const Face& f : now.proxy.faces) {
    std::array<std::uint32_t, 3> fragment;
    for (int k = 0; k < 3; ++k)
      fragment[k] = organ.body().cut().fragment(now.mechanics.body->vertices[f[k]].tetrahedron);
    ASSERT_EQ(fragment[0], fragment[1]);  // no face hangs between the two
    ASSERT_EQ(fragment[0], fragment[2]);
    const auto& at = now.proxy.vertices;
    volume[fragment[0]] += at[f[0]].cross(at[f[1]]).dot(at[f[2]]) / 6;
  }
  std::sort(volume.begin(), volume.end());
  EXPECT_NEAR(volume[0], 26.7 * 40 * 40, 0.01 * 60 * 40 * 40);
  EXPECT_NEAR(volume[1], 33.3 * 40 * 40, 0.01 * 60 * 40 * 40);
}

TEST(CutOrgan, ACutThatEndsWithinLeavesOneBody) {
  CutOrgan organ(box_organ());
  BladeSweeps sweeps(organ);
  EXPECT_GT(draw_blade(sweeps, organ, {3.3, -25, 0}, {3.3, 5, 0}, 30), 0u);
  EXPECT_EQ(organ.body().cut().fragment_count(), 1u);
  EXPECT_GT(organ.now().proxy.faces.size(), box_organ().proxy.faces.size());
}

TEST(CutOrgan, TwentyCutsInOneOrgan) {
  CutOrgan organ(box_organ(0.5));
  BladeSweeps sweeps(organ);
  for (int i = 0; i < 20; ++i) {
    const double x = -14 + 1.45 * i, y = i % 2 ? 15 : -15;
    draw_blade(sweeps, organ, {x, -y, -5 + 0.5 * i}, {-x / 2, y, 1.5 - 0.5 * i}, 20, 2,
               std::size_t(i % 3));
  }
  const auto volumes = organ.body().cut().fragment_volumes(organ.body().uncut());
  const double whole = test::volume_mm3(organ.body().uncut());
  EXPECT_NEAR(std::accumulate(volumes.begin(), volumes.end(), 0.0), whole, 1e-6 * whole);
  for (const Vector3d& v : organ.now().proxy.vertices) ASSERT_TRUE(v.allFinite());
  for (const EmbeddedVertex& v : organ.now().mechanics.body->vertices) {
    ASSERT_NEAR(v.weights[0] + v.weights[1] + v.weights[2] + v.weights[3], 1, 1e-9);
    for (const double w : v.weights) ASSERT_LT(std::abs(w), 3);
  }
}

}  // namespace
}  // namespace organbake
