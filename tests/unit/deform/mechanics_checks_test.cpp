// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "organbake/core/error.h"
#include "organbake/deform/deformer.h"
#include "unit/deform/test_bodies.h"

namespace organbake {
namespace {

using ::testing::HasSubstr;

TEST(DeformOptions, DefaultsAreValid) { EXPECT_NO_THROW(DeformOptions{}.check()); }

TEST(DeformOptions, EachBoundIsChecked) {
  const auto refuses = [](const std::function<void(DeformOptions&)>& spoil) {
    DeformOptions options;
    spoil(options);
    EXPECT_THROW(options.check(), UsageError);
  };
  refuses([](DeformOptions& o) { o.time_step_s = 0; });
  refuses([](DeformOptions& o) { o.time_step_s = 2; });
  refuses([](DeformOptions& o) { o.time_step_s = std::nan(""); });
  refuses([](DeformOptions& o) { o.iterations = 0; });
  refuses([](DeformOptions& o) { o.iterations = 1001; });
  refuses([](DeformOptions& o) { o.friction = -0.1; });
  refuses([](DeformOptions& o) { o.friction = std::nan(""); });
}

// Spoils one thing in a good body and expects an error whose text holds `words`.
void refuses(const std::string& words,
             const std::function<void(TriangleMesh&, MechanicsModel&, BaseLayer&)>& spoil) {
  TriangleMesh mesh = test::geodesic_sphere(2, 40);
  MechanicsModel mechanics = test::spring_body(mesh);
  BaseLayer base = test::sphere_base(mesh, 40, 3);
  ASSERT_NO_THROW(Deformer(mesh, mechanics, base));
  spoil(mesh, mechanics, base);
  try {
    const Deformer deformer(mesh, mechanics, base);
    FAIL() << "accepted: " << words;
  } catch (const BadDataError& error) {
    EXPECT_THAT(error.what(), HasSubstr(words));
  }
}

using Mesh = TriangleMesh;
using Model = MechanicsModel;
using Base = BaseLayer;

TEST(Deformer, RefusesAProxyItCannotUse) {
  refuses("no vertices", [](Mesh& m, Model&, Base&) { m = {}; });
  refuses("vertex 3", [](Mesh& m, Model&, Base&) { m.vertices[3].x() = std::nan(""); });
  refuses("face 7", [](Mesh& m, Model&, Base&) { m.faces[7][1] = 42; });
}

TEST(Deformer, RefusesMechanicsThatDoNotFit) {
  refuses("41 masses", [](Mesh&, Model& m, Base&) { m.mass_kg.pop_back(); });
  refuses("vertex 5", [](Mesh&, Model& m, Base&) { m.mass_kg[5] = 0; });
  refuses("vertex 6", [](Mesh&, Model& m, Base&) { m.mass_kg[6] = std::nan(""); });
  refuses("spring 2", [](Mesh&, Model& m, Base&) { m.springs[2].b = 42; });
  refuses("spring 3", [](Mesh&, Model& m, Base&) { m.springs[3].a = m.springs[3].b; });
  refuses("rest length", [](Mesh&, Model& m, Base&) { m.springs[0].rest_length_mm = 0; });
  refuses("stiffness", [](Mesh&, Model& m, Base&) { m.springs[0].stiffness_n_per_mm = -1; });
  refuses("damping", [](Mesh&, Model& m, Base&) { m.springs[0].damping_n_s_per_mm = NAN; });
  refuses("anchor 99", [](Mesh&, Model& m, Base&) { m.anchors.push_back(99); });
  refuses("vertex 42", [](Mesh&, Model& m, Base&) { m.elimination_order = {42}; });
  refuses("0 times", [](Mesh&, Model& m, Base&) { m.elimination_order = {41}; });
  refuses("42 times",
          [](Mesh&, Model& m, Base&) { m.anchors = {}, m.elimination_order.resize(42); });
  refuses("volume stiffness", [](Mesh&, Model& m, Base&) { m.volume_stiffness = 1.5; });
}

TEST(Deformer, RefusesABaseLayerThatDoesNotFit) {
  refuses("79 faces", [](Mesh&, Model&, Base& b) { b.face_count = 79; });
  refuses("no steps", [](Mesh&, Model&, Base& b) { b.steps = 0; });
  refuses("799 heights", [](Mesh&, Model&, Base& b) { b.height_mm.pop_back(); });
  refuses("node 4", [](Mesh&, Model&, Base& b) { b.height_mm[4] = NAN; });
}

TEST(Deformer, RefusesTipsThatMakeNoSense) {
  const TriangleMesh mesh = test::geodesic_sphere(2, 40);
  Deformer deformer(mesh, test::spring_body(mesh), {});
  Instrument good;
  good.active = true;
  good.position_mm = {0, 0, 44};
  deformer.step({good});
  const auto before = deformer.positions();

  const auto refuses_tip = [&](const std::function<void(Instrument&)>& spoil) {
    Instrument bad = good;
    spoil(bad);
    try {
      deformer.step({good, bad});
      FAIL() << "accepted";
    } catch (const UsageError& error) {
      EXPECT_THAT(error.what(), HasSubstr("tip 1"));
    }
    EXPECT_TRUE(deformer.positions() == before) << "a refused step changes nothing";
  };
  refuses_tip([](Instrument& t) { t.position_mm.y() = std::nan(""); });
  refuses_tip([](Instrument& t) { t.position_mm.y() = INFINITY; });
  refuses_tip([](Instrument& t) { t.position_mm.y() = 1e200; });
  refuses_tip([](Instrument& t) { t.radius_mm = 0; });
  refuses_tip([](Instrument& t) { t.radius_mm = 0.01; });
  refuses_tip([](Instrument& t) { t.radius_mm = std::nan(""); });

  EXPECT_THROW(deformer.step(std::vector<Instrument>(kMostInstruments + 1, good)), UsageError);
  EXPECT_TRUE(deformer.positions() == before);

  Instrument idle;
  idle.position_mm.x() = std::nan("");
  EXPECT_NO_THROW(deformer.step({good, idle})) << "an inactive tip may hold anything";
}

}  // namespace
}  // namespace organbake
