// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/mechanics/mechanics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "organbake/core/error.h"
#include "support/meshes.h"

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

TEST(MechanicsOptions, DefaultsAreValidAndBoundsAreNot) {
  EXPECT_NO_THROW(MechanicsOptions().check());
  const auto refused = [](auto change) {
    MechanicsOptions o;
    change(o);
    EXPECT_THROW(o.check(), UsageError);
  };
  refused([](auto& o) { o.young_modulus_kpa = 0; });
  refused([](auto& o) { o.density_kg_per_m3 = -1; });
  refused([](auto& o) { o.thickness_mm = std::numeric_limits<double>::quiet_NaN(); });
  refused([](auto& o) { o.damping_ratio = -0.1; });
  refused([](auto& o) { o.volume_stiffness = 1.5; });
  refused([](auto& o) { o.anchor_fraction = 0.95; });
  refused([](auto& o) { o.anchor_direction.setZero(); });
  refused([](auto& o) { o.instrument_radius_mm = 0; });
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

TEST(MakeMechanics, EverySpringIsSound) {
  TriangleMesh body = lumpy_mesh(50, 2);
  body.faces.push_back({0, 0, 1});                 // what naive clustering leaves
  body.vertices.push_back(body.vertices.front());  // and a vertex without a face
  const MechanicsModel model = make_mechanics(body, {});
  for (const Spring& s : model.springs) {
    EXPECT_LT(s.a, s.b);
    EXPECT_GT(s.rest_length_mm, 0);
    EXPECT_GT(s.stiffness_n_per_mm, 0);
    EXPECT_GT(s.damping_n_s_per_mm, 0);
  }
  for (const double m : model.mass_kg) EXPECT_GT(m, 0);
  const std::string text = mechanics_to_json(model);
  EXPECT_EQ(mechanics_to_json(mechanics_from_json(text, "m", body.vertices.size())), text);
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

}  // namespace
}  // namespace organbake
