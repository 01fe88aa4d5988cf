// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>

#include "organbake/deform/deformer.h"
#include "unit/deform/test_bodies.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

// Naive vertex clustering on a grid: what the paper's 80-face proxies come from. The result has
// doubled faces, edges of four faces and flaps.
TriangleMesh clustered(const TriangleMesh& mesh, double cell_mm) {
  TriangleMesh out;
  std::map<std::array<long, 3>, std::uint32_t> cells;
  std::vector<std::uint32_t> cell_of;
  for (const Vector3d& v : mesh.vertices) {
    const std::array<long, 3> key = {std::lround(v.x() / cell_mm), std::lround(v.y() / cell_mm),
                                     std::lround(v.z() / cell_mm)};
    const auto [entry, made] =
        cells.try_emplace(key, static_cast<std::uint32_t>(out.vertices.size()));
    if (made) out.vertices.push_back(v);
    cell_of.push_back(entry->second);
  }
  for (const Face& f : mesh.faces) {
    const Face g = {cell_of[f[0]], cell_of[f[1]], cell_of[f[2]]};
    if (g[0] != g[1] && g[1] != g[2] && g[2] != g[0]) out.faces.push_back(g);
  }
  return out;
}

// Pokes from several sides; everything must stay finite and in place.
void survives_poking(const TriangleMesh& mesh, const MechanicsModel& mechanics,
                     const BaseLayer& base, double bound_mm) {
  Deformer deformer(mesh, mechanics, base);
  for (int side = 0; side < 6; ++side) {
    Vector3d from = Vector3d::Zero();
    from[side / 2] = side % 2 ? -1 : 1;
    Instrument tip;
    tip.active = true;
    for (int step = 0; step < 60; ++step) {
      tip.position_mm = (50 - 0.5 * step) * from + Vector3d(1, 2, 3);
      ASSERT_FALSE(deformer.step({tip}).recovered);
      for (const Vector3d& p : deformer.positions()) {
        ASSERT_TRUE(p.allFinite());
        ASSERT_LT(p.norm(), bound_mm);
      }
    }
    for (int step = 0; step < 20; ++step) deformer.step({});
  }
}

TEST(DegenerateBodies, ClusteringProxies) {
  for (const double cell : {20.0, 28.0, 45.0}) {
    const TriangleMesh mesh = clustered(test::lumpy_organ(8, 40, 12), cell);
    ASSERT_GT(mesh.faces.size(), 8u);
    survives_poking(mesh, test::spring_body(mesh), {}, 200);
  }
}

TEST(DegenerateBodies, FacesWithoutAreaAndCoincidentVertices) {
  TriangleMesh mesh = test::geodesic_sphere(2, 40);
  MechanicsModel mechanics = test::spring_body(mesh);
  // A vertex doubled, joined by sliver faces and a spring between coincident points' neighbours.
  const auto twin = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.push_back(mesh.vertices[0]);
  mesh.faces.push_back({0, twin, mesh.faces[0][1]});
  mesh.faces.push_back({0, 0, twin});
  mechanics.mass_kg.push_back(mechanics.mass_kg[0]);
  mechanics.springs.push_back({0, twin, 1, 1, 0});  // rests at 1 mm, starts at 0
  survives_poking(mesh, mechanics, {}, 200);
}

TEST(DegenerateBodies, LooseVerticesAndNoSprings) {
  const TriangleMesh mesh = test::geodesic_sphere(2, 40);
  MechanicsModel mechanics = test::spring_body(mesh);
  mechanics.springs.clear();
  mechanics.anchors.clear();
  survives_poking(mesh, mechanics, {}, 1e5);
}

TEST(DegenerateBodies, EverythingAnchored) {
  const TriangleMesh mesh = test::geodesic_sphere(2, 40);
  MechanicsModel mechanics = test::spring_body(mesh);
  mechanics.anchors.clear();
  for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) mechanics.anchors.push_back(v);
  Deformer deformer(mesh, mechanics, test::sphere_base(mesh, 40, 3));
  Instrument tip;
  tip.active = true;
  for (int step = 0; step < 20; ++step) {
    tip.position_mm = {0, 0, 45.0 - step};
    tip.kind = step % 4 == 3 ? InstrumentKind(Grasper{}) : Ball{};
    EXPECT_EQ(deformer.step({tip}).contacts, 0u);
    EXPECT_FALSE(deformer.moved());
  }
  EXPECT_TRUE(deformer.positions() == mesh.vertices);
}

// Poking beside the anchors: the held vertices stay, and the loose ones are not thrown to make up.
TEST(DegenerateBodies, PokesNextToAnchors) {
  constexpr double kNoFarther_mm = 15;  // depth plus radius
  const TriangleMesh mesh = test::geodesic_sphere(2, 40);
  test::BodyOptions body;
  body.anchored_below = 0.1;
  Deformer deformer(mesh, test::spring_body(mesh, body), {});
  Instrument tip;
  tip.active = true;
  for (int step = 0; step < 300; ++step) {
    const double depth = std::min(10.0, 0.2 * step), z = 20 - 0.1 * step;
    tip.position_mm = {46 - depth, 0, z};
    deformer.step({tip});
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
      ASSERT_LT((deformer.positions()[v] - mesh.vertices[v]).norm(), kNoFarther_mm) << step;
    }
  }
}

TEST(DegenerateBodies, OpenSurface) {
  TriangleMesh mesh = test::geodesic_sphere(4, 40);
  std::erase_if(mesh.faces, [&](const Face& f) { return mesh.vertices[f[0]].z() < 0; });
  survives_poking(mesh, test::spring_body(mesh), {}, 200);
}

TEST(DegenerateBodies, NoFaces) {
  TriangleMesh mesh = test::geodesic_sphere(2, 40);
  const MechanicsModel mechanics = test::spring_body(mesh);
  mesh.faces.clear();
  Deformer deformer(mesh, mechanics, {});
  Instrument tip;
  tip.active = true;
  deformer.step({tip});
  EXPECT_TRUE(deformer.positions() == mesh.vertices);
}

}  // namespace
}  // namespace organbake
