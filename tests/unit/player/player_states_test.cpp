// SPDX-License-Identifier: Apache-2.0
// States that another solver sets, against the player's own.

#include "fuzz/heap_meter.h"
#include "organbake/core/error.h"
#include "organbake/player/embedded_types.h"
#include "organbake/player/orbit.h"
#include "organbake/player/player.h"
#include "organs_to_play.h"
#include "support/error_message.h"
#include "support/testing.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

std::vector<double> flat(const std::vector<Vector3d>& places) {
  std::vector<double> xyz;
  for (const Vector3d& p : places) xyz.insert(xyz.end(), p.data(), p.data() + 3);
  return xyz;
}

// The organ to cut, in a light.
const Bundle& lit_organ() {
  static const Bundle bundle = [] {
    Bundle lit = organ_to_cut();
    Lighting light;
    light.ambient_above = light.ambient_below = Vector3d::Constant(0.3);
    light.lamps = {{Vector3d(1, -1, 1).normalized(), Vector3d::Constant(0.6)}};
    light.gloss = {{0.2, 20}};
    lit.lighting = light;
    return lit;
  }();
  return bundle;
}

Instrument probe(double depth_mm) {
  const Vector3d out = lit_organ().cameras.manifold.directions.front();
  Vector3d top = lit_organ().proxy.vertices.front();
  for (const Vector3d& v : lit_organ().proxy.vertices)
    if (v.dot(out) > top.dot(out)) top = v;
  Instrument tip;
  tip.active = true;
  tip.position_mm = top + (5 - depth_mm) * out;
  return tip;
}

Frame drawn(Player& player, DrawnLight light, bool layers = true) {
  DrawOptions options;
  options.light = light;
  options.keep_bound = layers;
  options.keep_depth = true;
  Frame frame;
  player.draw(orbit_view(lit_organ().cameras, {0.2, 0.15}, 160, 120), options, frame);
  return frame;
}

void expect_same(const Frame& a, const Frame& b) {
  EXPECT_EQ(a.color.pixels, b.color.pixels);
  EXPECT_EQ(a.depth_mm, b.depth_mm);
  ASSERT_EQ(a.bound.size(), b.bound.size());
  EXPECT_EQ(std::memcmp(a.bound.data(), b.bound.data(), a.bound.size() * sizeof(BoundPixel)), 0);
}

constexpr DrawnLight kLights[] = {DrawnLight::baked, DrawnLight::world, DrawnLight::scope};

TEST(PlayerStates, SetVerticesAreDrawnAsAfterAStepToTheByte) {
  Player own(lit_organ()), set(lit_organ());
  const Frame rest = drawn(set, DrawnLight::world);
  for (int i = 0; i < 4; ++i) {
    own.step({probe(2.0 * i)});
    set.set_vertices(flat(own.proxy_positions()));
    for (const DrawnLight light : kLights) expect_same(drawn(set, light), drawn(own, light));
  }
  EXPECT_NE(drawn(set, DrawnLight::world).color.pixels, rest.color.pixels);
  set.reset();
  expect_same(drawn(set, DrawnLight::world), rest);
}

// The solver itself moves vertices and nodes by sums in another order.
TEST(PlayerStates, SetNodesCarryTheSkinAsTheSolverDoes) {
  Player own(lit_organ(), with_fem());
  Deformer twin({{lit_organ().proxy, lit_organ().mechanics, lit_organ().base}}, with_fem());
  for (const TissueSolver solver : {TissueSolver::fem, TissueSolver::springs}) {
    Player set(lit_organ()), by_vertices(lit_organ());
    set.set_solver(solver);
    own.reset(), twin.reset();
    for (int i = 0; i < 3; ++i) {
      own.step({probe(4.0 * i)});
      twin.step({probe(4.0 * i)});
      set.set_nodes(flat(twin.node_positions(0)));
      for (std::size_t v = 0; v < own.proxy_positions().size(); ++v)
        EXPECT_LT((set.proxy_positions()[v] - own.proxy_positions()[v]).norm(), 1e-9);
    }
    by_vertices.set_vertices(flat(set.proxy_positions()));
    for (const DrawnLight light : kLights)
      expect_same(drawn(set, light), drawn(by_vertices, light));
  }
}

TEST(PlayerStates, ACutOrganTakesThemToo) {
  Player player(lit_organ(), with_fem());
  for (int i = 0; i <= 60; ++i) player.step({blade_at(i / 60.0)});
  let_part(player);
  ASSERT_TRUE(player.is_cut());
  const std::vector<double> then = flat(player.proxy_positions());
  std::vector<Frame> frames;
  for (const DrawnLight light : kLights) frames.push_back(drawn(player, light));
  for (int i = 0; i < 6; ++i) player.step({probe(2.0 * i)});
  EXPECT_NE(flat(player.proxy_positions()), then);
  EXPECT_THROW(player.set_vertices(flat(lit_organ().proxy.vertices)), UsageError);  // too few
  player.set_vertices(then);
  for (std::size_t l = 0; l < frames.size(); ++l) expect_same(drawn(player, kLights[l]), frames[l]);
  player.step({});
  EXPECT_EQ(player.proxy_positions().size(), then.size() / 3);
  player.reset();
  player.set_vertices(flat(lit_organ().proxy.vertices));  // whole again
}

TEST(PlayerStates, StepsGoOnFromAStateThatIsSet) {
  for (const TissueSolver solver : {TissueSolver::springs, TissueSolver::fem}) {
    Player player(lit_organ());
    player.set_solver(solver);
    const Vector3d front = lit_organ().cameras.manifold.directions.front();
    std::vector<Vector3d> dent = dented(lit_organ().proxy, front, 6);
    player.set_vertices(flat(dent));
    EXPECT_EQ(player.proxy_positions(), dent);
    player.step({});
    // One step from where it lay still: not at rest at once, nor flung about.
    double least = 0, most = 0;
    for (std::size_t v = 0; v < dent.size(); ++v) {
      most = std::max(most, (player.proxy_positions()[v] - dent[v]).norm());
      least = std::max(least, (player.proxy_positions()[v] - lit_organ().proxy.vertices[v]).norm());
    }
    EXPECT_GT(least, 0.5) << to_string(solver);
    EXPECT_LT(most, 6) << to_string(solver);
    for (int i = 0; i < 400; ++i) player.step({});
    double left = 0;
    for (std::size_t v = 0; v < dent.size(); ++v)
      left = std::max(left, (player.proxy_positions()[v] - lit_organ().proxy.vertices[v]).norm());
    EXPECT_LT(left, 0.05) << to_string(solver);  // it springs back
  }
}

// The tissue lies still in a state that is set, however it came there.
TEST(PlayerStates, AStateThatIsSetHasNoVelocity) {
  Player one(lit_organ()), other(lit_organ());
  const std::vector<double> state =
      flat(dented(lit_organ().proxy, lit_organ().cameras.manifold.directions.front(), 6));
  one.set_vertices(state);
  one.step({});
  for (int i = 0; i < 5; ++i) other.step({probe(3.0 * i)});
  other.set_vertices(state);
  other.step({});
  EXPECT_EQ(one.proxy_positions(), other.proxy_positions());
}

TEST(PlayerStates, TheInsideFollowsASkinThatIsSet) {
  Player player(lit_organ(), with_fem()), pressed(lit_organ(), with_fem());
  for (int i = 0; i < 10; ++i) pressed.step({probe(1.0 * i)});
  player.set_vertices(flat(pressed.proxy_positions()));
  player.contact_force_n({});  // has the solver follow
  player.step({});
  double most = 0;
  for (std::size_t v = 0; v < lit_organ().proxy.vertices.size(); ++v)
    most = std::max(most, (player.proxy_positions()[v] - pressed.proxy_positions()[v]).norm());
  EXPECT_LT(most, 2);  // mm, of 9 pressed: the fit, and what springs back in a sixtieth of a second
}

std::string refusal(Player& player, const std::vector<double>& xyz) {
  return message_of(ExitCode::usage, [&] { player.set_vertices(xyz); });
}

TEST(PlayerStates, WhatCannotBeThisOrganIsRefusedAndNothingLost) {
  Player player(lit_organ());
  const std::vector<double> good =
      flat(dented(lit_organ().proxy, lit_organ().cameras.manifold.directions.front(), 6));
  player.set_vertices(good);
  const auto changed = [&](auto&& change) {
    std::vector<double> bad = good;
    change(bad);
    const std::string said = refusal(player, bad);
    EXPECT_EQ(flat(player.proxy_positions()), good) << said;
    return said;
  };
  const auto has = [](const std::string& said, const char* words) {
    EXPECT_NE(said.find(words), std::string::npos) << said;
  };
  has(changed([](auto& x) { x[7] = std::nan(""); }), "number 2 is not finite");
  has(changed([](auto& x) { x.back() = -INFINITY; }), "not finite");
  has(changed([](auto& x) { x[0] = 1e300; }), "span");
  has(changed([](auto& x) { x.resize(x.size() - 3); }), "41 vertices for an organ of 42");
  has(changed([](auto& x) { x.pop_back(); }), "125 coordinates of vertices for");
  has(changed([](auto& x) {
        for (double& n : x) n /= 1000;
      }),
      "in metres?");
  has(changed([](auto& x) {
        for (double& n : x) n /= 10;
      }),
      "in centimetres?");
  has(changed([](auto& x) {
        for (double& n : x) n += 5000;
      }),
      "of another world");
  has(changed([](auto& x) {
        for (std::size_t i = 0; i < x.size(); i += 3) x[i] = -x[i];
      }),
      "mirror image");
  has(refusal(player, {}), "0 vertices");
  EXPECT_THROW(player.set_vertices(good, 1), UsageError);
  Player springs(organ_to_play());
  EXPECT_THROW(springs.set_nodes(good), UsageError);
  player.step({});  // alive and well
}

TEST(PlayerStates, AnotherOrganOfTheSameSizeIsRefused) {
  SyntheticOptions fine = organ_options();
  fine.proxy_subdivisions = 3;
  Bundle organ = make_synthetic_bundle(fine);
  Player player(organ);
  std::vector<Vector3d> other = organ.proxy.vertices;  // its vertices in another order
  for (std::size_t v = 0; v < other.size(); ++v)
    other[v] = organ.proxy.vertices[(v * 211) % other.size()];
  EXPECT_NE(refusal(player, flat(other)).find("another organ's"), std::string::npos);
  EXPECT_EQ(player.proxy_positions(), organ.proxy.vertices);
}

TEST(PlayerStates, SettingTakesNoMemory) {
  Player player(lit_organ());
  const std::vector<double> vertices = flat(lit_organ().proxy.vertices),
                            nodes = flat(lit_organ().mechanics.body->nodes_mm);
  const std::vector<float> single(vertices.begin(), vertices.end());
  const auto set_all = [&] {
    player.set_vertices(vertices);
    player.set_vertices(single);
    player.set_nodes(nodes);
  };
  set_all(), set_all();
  const HeapMeter meter;
  for (int i = 0; i < 1000; ++i) set_all();
  EXPECT_EQ(meter.most_bytes(), 0u);
  const std::vector<double> taken(3000);
  EXPECT_GT(meter.most_bytes(), 0u);  // the meter counts
}

TEST(PlayerStates, ForcesOfToolsAreToldByVertex) {
  for (const TissueSolver solver : {TissueSolver::springs, TissueSolver::fem}) {
    Player player(lit_organ());
    player.set_solver(solver);
    const std::vector<Vector3d> rest = player.proxy_positions();
    const Vector3d out = lit_organ().cameras.manifold.directions.front();
    for (const Vector3d& f : player.contact_force_n({probe(-20)})) EXPECT_TRUE(f.isZero(0));
    const std::vector<Vector3d> forces = player.contact_force_n({probe(3)});
    const Vector3d sum = std::accumulate(forces.begin(), forces.end(), Vector3d(0, 0, 0));
    EXPECT_LT(sum.dot(out), -0.01) << to_string(solver);  // inward
    EXPECT_EQ(player.proxy_positions(), rest);
    Player twin(lit_organ());
    twin.set_solver(solver);
    const Vector3d felt = twin.step({probe(3)}).tip_force_n[0];
    EXPECT_LT((sum + felt).norm(), 1e-9 * felt.norm());
    EXPECT_EQ(player.contact_force_n({probe(3)}), forces);  // it lay still meanwhile
    if (solver == TissueSolver::springs) continue;
    const std::vector<Vector3d> on_nodes = forces_on_nodes(lit_organ(), forces);
    const Vector3d all = std::accumulate(on_nodes.begin(), on_nodes.end(), Vector3d(0, 0, 0));
    EXPECT_LT((all - sum).norm(), 1e-9 * sum.norm());
  }
  EXPECT_THROW(forces_on_nodes(organ_to_play(), organ_to_play().proxy.vertices), UsageError);
}

// Poked, pulled, cut through and poked again, with rest between.
std::vector<Instrument> tools_of_a_course(int step) {
  std::vector<Instrument> tools(3, probe(-20));
  for (Instrument& tool : tools) tool.active = false;
  const auto between = [step](int from, int to) { return step >= from && step < to; };
  if (between(2, 14) || between(104, 130)) tools[0] = probe((step < 14 ? step : step - 104) * 0.5);
  if (between(16, 30)) {
    tools[1] = probe(6 - (step - 16) * 0.6);
    tools[1].kind = Grasper{};
  }
  if (between(34, 95)) tools[2] = blade_at((step - 34) / 60.0);
  return tools;
}

TEST(PlayerStates, ARestoredStateGoesOnToTheByte) {
  constexpr int kSteps = 116, kOn = 12;
  for (const TissueSolver solver : {TissueSolver::springs, TissueSolver::fem}) {
    const int steps = solver == TissueSolver::fem ? kSteps : 34;  // springs cannot follow blades
    Bundle alive = lit_organ();
    alive.lighting->finish.grain.setConstant(0.03);  // its cuts bleed
    Player player(alive, {.solver = solver});
    std::vector<Player::State> states;
    std::vector<std::vector<Vector3d>> positions, forces_n;
    std::vector<std::vector<std::uint8_t>> pictures;
    const auto see = [&](int step) {
      return step % 7 == 0 ? drawn(player, DrawnLight::world).color.pixels
                           : std::vector<std::uint8_t>();
    };
    for (int step = 0; step < steps; ++step) {
      states.push_back(player.save_state(states.empty() ? Player::State() : states.back()));
      EXPECT_EQ(states.back().steps(), std::size_t(step));
      forces_n.push_back(player.step(tools_of_a_course(step)).tip_force_n);
      positions.push_back(player.proxy_positions());
      pictures.push_back(see(step));
    }
    ASSERT_EQ(player.is_cut(), solver == TissueSolver::fem);
    // Held and let go, asleep, amid a stroke, while a cut is under way, back to whole and forth.
    for (const int from : {110, 8, 20, 41, 44, 31, 0, 33}) {
      if (from >= steps) continue;
      player.restore_state(states[from]);
      for (int step = from; step < std::min(from + kOn, steps); ++step) {
        EXPECT_EQ(player.step(tools_of_a_course(step)).tip_force_n, forces_n[step])
            << from << " on to " << step;
        ASSERT_EQ(player.proxy_positions(), positions[step]) << from << " on to " << step;
        EXPECT_EQ(see(step), pictures[step]) << from << " on to " << step;
      }
    }
    EXPECT_LT(states[1].bytes_beside(states[0]), states[1].bytes_beside({}) / 4);  // both at rest
  }
}

TEST(PlayerStates, AStateHoldsWhatAnotherSolverSetAndLoadsAndIsOfOnePlayer) {
  Player player(lit_organ());
  std::vector<Vector3d> moved = lit_organ().proxy.vertices;
  for (Vector3d& v : moved) v.z() *= 1.05;
  player.set_vertices(flat(moved));
  const Player::State state = player.save_state();
  player.step({});
  const std::vector<Vector3d> after = player.proxy_positions();
  player.reset();
  player.restore_state(state);
  EXPECT_EQ(player.proxy_positions(), moved);
  player.step({});
  EXPECT_EQ(player.proxy_positions(), after);
  EXPECT_THROW(player.restore_state({}), UsageError);
  Player other(lit_organ());
  EXPECT_THROW(other.restore_state(state), UsageError);
}

TEST(PlayerStates, TheMeshTellsWhatASolverNeeds) {
  const Bundle& organ = lit_organ();
  const EmbeddedPlayer::Mesh mesh = organ_mesh(organ);
  ASSERT_EQ(mesh.vertices_mm.size(), organ.proxy.vertices.size());
  ASSERT_EQ(mesh.vertex_weights.size(), mesh.vertices_mm.size());
  for (std::size_t v = 0; v < mesh.vertices_mm.size(); ++v) {
    Vector3d at = Vector3d::Zero();
    for (int k = 0; k < 4; ++k) {
      const auto& node = mesh.nodes_mm[mesh.tetrahedra[mesh.vertex_tetrahedron[v]][k]];
      at += mesh.vertex_weights[v][k] * Vector3d(node.data());
    }
    EXPECT_LT((at - organ.proxy.vertices[v]).norm(), 1e-6);
  }
  double volume_mm3 = 0;
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t)
    volume_mm3 += mesh.fill[t] * volume_of(*organ.mechanics.body, {mesh.tetrahedra[t], 1});
  const double mass_kg = std::accumulate(mesh.node_mass_kg.begin(), mesh.node_mass_kg.end(), 0.0);
  EXPECT_NEAR(mass_kg, 1e-9 * volume_mm3 * mesh.density_kg_per_m3, 1e-9);
  EXPECT_EQ(mesh.spring_ends.size(), organ.mechanics.springs.size());
  EXPECT_EQ(mesh.node_anchors, organ.mechanics.body->anchors);
  EXPECT_EQ(mesh.young_modulus_kpa, organ.mechanics.young_modulus_kpa);
  EXPECT_TRUE(organ_mesh(organ_to_play()).tetrahedra.empty());
}

}  // namespace
}  // namespace organbake
