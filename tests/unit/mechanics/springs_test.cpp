// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/mechanics/mechanics.h"

#include <Eigen/SparseCholesky>

#include "organbake/core/error.h"
#include "organbake/deform/deformer.h"
#include "support/meshes.h"
#include "support/testing.h"
#include "tissue_parts.h"

namespace organbake {
namespace {

using Key = std::pair<std::uint32_t, std::uint32_t>;

std::map<Key, Spring> by_ends(const MechanicsModel& model) {
  std::map<Key, Spring> springs;
  for (const Spring& s : model.springs) springs[{s.a, s.b}] = s;
  return springs;
}

// The force (N) that holds opposite sides of a stretched body: springs across the plane x = x0.
double pull(const TriangleMesh& mesh, const MechanicsModel& model, double strain, double x0) {
  double force = 0;
  for (const Spring& s : model.springs) {
    const Eigen::Vector3d d = mesh.vertices[s.b] - mesh.vertices[s.a];
    const bool across = (mesh.vertices[s.a].x() < x0) != (mesh.vertices[s.b].x() < x0);
    if (!across) continue;
    const double stretch = strain * d.x() * d.x() / d.norm();  // of small strain along x alone
    force += s.stiffness_n_per_mm * stretch * std::abs(d.x()) / d.norm();
  }
  return force;
}

TEST(MakeMechanics, AnchorsNeedADirection) {
  MechanicsOptions options;
  options.anchor_direction.setZero();
  EXPECT_THROW(make_mechanics(sphere_mesh(50, 1), options), UsageError);
}

TEST(MakeMechanics, WhatIsTooSmallToBeTissueIsRefused) {
  EXPECT_NO_THROW(make_mechanics(sphere_mesh(0.05, 1), {}));
  EXPECT_THROW(make_mechanics(sphere_mesh(1e-4, 1), {}), BadDataError);
  EXPECT_THROW(make_mechanics(sphere_mesh(1e-13, 1), {}), BadDataError);
}

TEST(MakeMechanics, WeighsTheSkin) {
  const TriangleMesh sphere = sphere_mesh(50, 2);
  const MechanicsModel model = make_mechanics(sphere, {});
  const double mass = std::accumulate(model.mass_kg.begin(), model.mass_kg.end(), 0.0);
  const double expected = 1060e-9 * 15 * surface_area(sphere);
  EXPECT_NEAR(mass, expected, 1e-9 * expected);
}

TEST(MakeMechanics, MembraneStiffnessIsVanGeldersInNewtonPerMm) {
  // Two right triangles of 100 mm² each on a square: diagonal k = E t (A1 + A2)/L² =
  // 0.01 N/mm² · 15 mm · 200/800 (the square has side √200).
  TriangleMesh square;
  const double side = std::sqrt(200.0);
  square.vertices = {{0, 0, 0}, {side, 0, 0}, {side, side, 0}, {0, side, 0}};
  square.faces = {{0, 1, 2}, {0, 2, 3}};
  MechanicsOptions options;
  options.anchor_fraction = 0;
  const auto springs = by_ends(make_mechanics(square, options));
  EXPECT_NEAR(springs.at({0, 2}).stiffness_n_per_mm, 0.01 * 15 * 200 / 400, 1e-12);
  EXPECT_NEAR(springs.at({0, 1}).stiffness_n_per_mm, 0.01 * 15 * 100 / 200, 1e-12);
  EXPECT_NEAR(springs.at({1, 3}).rest_length_mm, 20, 1e-12);  // bends about the diagonal
}

TEST(MakeMechanics, StiffnessIsProportionalToYoungsModulus) {
  const TriangleMesh body = lumpy_mesh(50, 1);
  MechanicsOptions soft, stiff;
  stiff.young_modulus_kpa = 3 * soft.young_modulus_kpa;
  const double a = pull(body, make_mechanics(body, soft), 0.01, 3);
  EXPECT_NEAR(pull(body, make_mechanics(body, stiff), 0.01, 3), 3 * a, 1e-9 * a);
  EXPECT_GT(a, 0);
}

TEST(MakeMechanics, AStretchedBallPullsAboutAsHardAsTheTissueWould) {
  // A solid of 10 kPa with a section of π 50² mm² pulls with E·A·ε = 0.785 N at 1 % strain. Springs
  // are a lumped likeness: the same order of magnitude is what they promise.
  const TriangleMesh sphere = sphere_mesh(50, 2);
  const double force = pull(sphere, make_mechanics(sphere, {}), 0.01, 0.5);
  EXPECT_GT(force, 0.785 / 3);
  EXPECT_LT(force, 0.785 * 3);
}

TEST(MakeMechanics, StrutsCrossTheBody) {
  const TriangleMesh sphere = sphere_mesh(50, 1);
  std::vector<int> struts(sphere.vertices.size(), 0);
  for (const Spring& s : make_mechanics(sphere, {}).springs) {
    if (s.rest_length_mm < 80) continue;
    ++struts[s.a], ++struts[s.b];
  }
  EXPECT_GE(*std::min_element(struts.begin(), struts.end()), 1);
}

TEST(MakeMechanics, HoldsTheBackOfTheOrgan) {
  const TriangleMesh body = lumpy_mesh(50, 2);
  const MechanicsModel model = make_mechanics(body, {});
  EXPECT_EQ(model.anchors.size(), static_cast<std::size_t>(std::ceil(0.15 * body.vertices.size())));
  double front = 1e9, rest_front = -1e9;
  for (std::uint32_t v = 0; v < body.vertices.size(); ++v) {
    const bool held = std::binary_search(model.anchors.begin(), model.anchors.end(), v);
    double& edge = held ? front : rest_front;
    edge = held ? std::min(edge, body.vertices[v].y()) : std::max(edge, body.vertices[v].y());
  }
  EXPECT_GE(front, rest_front);
}

TEST(MakeMechanics, RefusesAProxyWithoutArea) {
  EXPECT_THROW(make_mechanics(TriangleMesh{}, {}), BadDataError);
  TriangleMesh flat = tetrahedron_mesh();
  for (auto& v : flat.vertices) v.setZero();
  EXPECT_THROW(make_mechanics(flat, {}), BadDataError);
}

constexpr double kRounding = 1e-14;  // a handful of operations on numbers of about 1

// 10 kPa over 100 mm² and 50 mm: 1e4 N/m² · 1e-4 m² / 0.05 m = 20 N/m = 0.02 N/mm.
TEST(SpringBuilder, ABarHasTheStiffnessOfTissue) {
  TriangleMesh mesh = tetrahedron_mesh();
  mesh.vertices[1] = {50, 0, 0};
  SpringBuilder network(mesh, 10);
  ASSERT_TRUE(network.add_bar(1, 0, 100));
  // m = 0.2·0.3/0.5 = 0.12 kg; critical: 2√(20 N/m · 0.12 kg) = 2√2.4 N·s/m.
  const std::vector<Spring> springs = network.springs({0.2, 0.3, 1, 1}, 0.5);
  ASSERT_EQ(springs.size(), 1u);
  EXPECT_EQ(springs[0].a, 0u);
  EXPECT_EQ(springs[0].b, 1u);
  EXPECT_NEAR(springs[0].rest_length_mm, 50, kRounding);
  EXPECT_NEAR(springs[0].stiffness_n_per_mm, 0.02, kRounding);
  EXPECT_NEAR(springs[0].damping_n_s_per_mm, std::sqrt(2.4) * 1e-3, kRounding);
}

std::size_t part_count(const TriangleMesh& mesh, const MechanicsModel& model) {
  SpringBuilder network(mesh, 1);
  for (const Spring& s : model.springs) network.add_bar(s.a, s.b, 1);
  const std::vector<std::uint32_t> parts = network.parts();
  return std::set<std::uint32_t>(parts.begin(), parts.end()).size();
}

TEST(MakeMechanics, PartsOfAnOrganHangTogether) {
  TriangleMesh organ = sphere_mesh(20, 1);
  for (const double x : {60.0, 100.0, 400.0}) {
    organ = joined(organ, moved(sphere_mesh(15, 0), {x, 5, 0}));
  }
  EXPECT_EQ(part_count(organ, make_mechanics(organ, {})), 1u);
}

// Parts that lie on top of each other vertex by vertex have no length between their twins.
TEST(MakeMechanics, CoincidentPartsHangTogether) {
  const TriangleMesh twice = joined(sphere_mesh(20, 0), sphere_mesh(20, 0));
  EXPECT_EQ(part_count(twice, make_mechanics(twice, {})), 1u);
}

// A face on an edge of two others, an opposite pair, a needle, a face without area and one that
// naive clustering leaves, a vertex without a face.
TEST(MakeMechanics, BrokenProxiesStillGetSoundSprings) {
  TriangleMesh mesh = lumpy_mesh(30, 1);
  const Face f = mesh.faces[0];
  mesh.vertices.push_back({60, 60, 60});
  mesh.vertices.push_back(0.5 * (mesh.vertices[f[0]] + mesh.vertices[f[1]]));
  const auto far = static_cast<std::uint32_t>(mesh.vertices.size() - 2);
  mesh.faces.push_back({f[0], f[1], far});
  mesh.faces.push_back({f[1], f[0], far});
  mesh.faces.push_back({f[0], f[1], far + 1});
  mesh.faces.push_back({f[2], f[2], f[0]});
  mesh.faces.push_back({0, 0, 1});
  mesh.vertices.push_back(mesh.vertices.front());
  const MechanicsModel model = make_mechanics(mesh, {});
  const std::string text = mechanics_to_json(model);
  EXPECT_EQ(mechanics_to_json(mechanics_from_json(text, "m", mesh.vertices.size())), text);
  for (const Spring& s : model.springs) {
    ASSERT_LT(s.a, s.b);
    ASSERT_TRUE(s.rest_length_mm > 0 && s.stiffness_n_per_mm > 0 && s.damping_n_s_per_mm > 0);
    ASSERT_TRUE(std::isfinite(s.stiffness_n_per_mm));
  }
  for (const double mass : model.mass_kg) ASSERT_GT(mass, 0);
}

TEST(MakeMechanics, AtLeastThreeAnchorsAndNeverAll) {
  MechanicsOptions options;
  options.anchor_fraction = 0;
  EXPECT_EQ(make_mechanics(lumpy_mesh(30, 1), options).anchors.size(), 3u);
  options.anchor_fraction = 0.9;
  EXPECT_EQ(make_mechanics(tetrahedron_mesh(), options).anchors.size(), 3u);
  TriangleMesh one;
  one.vertices = {{0, 0, 0}, {9, 0, 0}, {0, 9, 0}};
  one.faces = {{0, 1, 2}};
  EXPECT_EQ(make_mechanics(one, options).anchors.size(), 2u);
}

TEST(MakeMechanics, IsRepeatable) {
  const TriangleMesh mesh = lumpy_mesh(30, 2);
  EXPECT_EQ(mechanics_to_json(make_mechanics(mesh, {})),
            mechanics_to_json(make_mechanics(mesh, {})));
}

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
