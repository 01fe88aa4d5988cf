// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "core/error.h"
#include "core/temporary_folder.h"
#include "organ_to_play.h"
#include "player/embedded_player.h"
#include "player/live_session.h"
#include "player/play.h"
#include "player/player.h"
#include "player/skin_point.h"
#include "support/cut_bodies.h"
#include "support/small_bundle.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

// The organ to play, of tetrahedra of 15 mm.
const Bundle& organ_to_cut() {
  static const Bundle bundle = [] {
    Bundle made = organ_to_play();
    made.mechanics.body = test::tissue_under(made.proxy, 15);
    // Held on one side of where it will be cut.
    const double middle = bounds(made.proxy).center().x();
    std::erase_if(made.mechanics.body->anchors,
                  [&](std::uint32_t n) { return made.mechanics.body->nodes_mm[n].x() > middle; });
    return made;
  }();
  return bundle;
}

DeformOptions with_fem() {
  DeformOptions options;
  options.solver = TissueSolver::fem;
  return options;
}

// A blade through the whole organ beside its middle, from far to near, edge upright.
InstrumentTip blade_at(double share) {
  const Vector3d center = bounds(organ_to_cut().proxy).center();
  InstrumentTip tip;
  tip.active = true;
  tip.mode = InstrumentMode::cut;
  tip.radius_mm = 0.4;
  tip.position_mm = center + Vector3d(22.3, -75 + 150 * share, -80);
  tip.axis_mm = Vector3d(0, 0, 160);
  return tip;
}

// What was swept parts a few steps later, and then what was swept meanwhile.
void let_part(Player& player) {
  for (int i = 0; i < 2 * Player::kPartingSteps; ++i) player.step({});
}

void cut_in_two(Player& player) {
  for (int i = 0; i <= 60; ++i) player.step({blade_at(i / 60.0)});
  let_part(player);
}

Script cutting_script() {
  Script script;
  script.name = "cut";
  script.frames = 40;
  script.width = 160, script.height = 120;
  script.solver = TissueSolver::fem;
  script.camera = {{0, {}}, {39, {0.5, 0.2, 1.1}}};
  const InstrumentTip from = blade_at(0), to = blade_at(1);
  script.instruments.push_back({"scalpel",
                                0.4,
                                InstrumentMode::cut,
                                {{0, from.position_mm}, {0.5, to.position_mm}},
                                {},
                                from.axis_mm});
  return script;
}

std::vector<std::uint8_t> bytes_of(Player& player, const Script& script) {
  std::vector<std::uint8_t> bytes;
  play(player, script, {}, [&](int, const Frame& frame) {
    bytes.insert(bytes.end(), frame.color.pixels.begin(), frame.color.pixels.end());
  });
  return bytes;
}

TEST(PlayerCuts, SpringsAreRefusedAndSaySo) {
  Player player(organ_to_cut());
  try {
    player.step({blade_at(0.5)});
    FAIL();
  } catch (const UsageError& error) {
    EXPECT_NE(std::string(error.what()).find("solver fem"), std::string::npos);
  }
}

TEST(PlayerCuts, ABladeNeedsAnEdge) {
  Player player(organ_to_cut(), with_fem());
  InstrumentTip tip = blade_at(0.5);
  tip.axis_mm.setZero();
  EXPECT_THROW(player.step({tip}), UsageError);
  Script script = cutting_script();
  script.instruments[0].axis_mm.setZero();
  EXPECT_THROW(script_from_json(script_to_json(script), "script"), BadDataError);
}

TEST(PlayerCuts, ScriptsOfBladesReadBack) {
  const Script script = cutting_script();
  const Script read = script_from_json(script_to_json(script), "script");
  EXPECT_EQ(read.instruments[0].mode, InstrumentMode::cut);
  EXPECT_EQ(read.instruments[0].axis_mm, script.instruments[0].axis_mm);
}

Script snipping_script() {
  Script script = cutting_script();
  InstrumentPath& scissors = script.instruments[0];
  const Vector3d center = bounds(organ_to_cut().proxy).center();
  scissors.mode = InstrumentMode::snip;
  scissors.path = {{0, center + Vector3d(22.3, 80, 0)}, {0.5, center + Vector3d(22.3, 80, 0)}};
  scissors.path[0].opening_mm = 300;
  scissors.axis_mm = Vector3d(0, -240, 0);
  scissors.opens_along = Vector3d(0, 0, 2);
  scissors.cut_width_mm = 1.5;
  return script;
}

TEST(PlayerCuts, ScissorsCutThroughAndReplay) {
  const std::string text = script_to_json(snipping_script());
  const Script read = script_from_json(text, "s");
  EXPECT_EQ(read.instruments[0].mode, InstrumentMode::snip);
  EXPECT_EQ(read.instruments[0].opens_along, Vector3d(0, 0, 2));
  EXPECT_EQ(read.instruments[0].cut_width_mm, 1.5);
  EXPECT_EQ(script_to_json(read), text);
  Player player(organ_to_cut(), with_fem()), again(organ_to_cut(), with_fem());
  const std::vector<std::uint8_t> once = bytes_of(player, snipping_script());
  EXPECT_EQ(player.piece_count(), 2u);
  EXPECT_EQ(bytes_of(again, read), once);
}

TEST(PlayerCuts, WhatIsForBladesAloneIsRefusedOfOthers) {
  const auto refused = [](const Script& script, const std::string& key) {
    try {
      script_from_json(script_to_json(script), "s");
      ADD_FAILURE() << key;
    } catch (const BadDataError& error) {
      EXPECT_NE(std::string(error.what()).find(key), std::string::npos) << error.what();
    }
  };
  Script script = snipping_script();
  script.instruments[0].mode = InstrumentMode::cut;  // opening_mm stays
  refused(script, "opening_mm");
  script = cutting_script();
  script.instruments[0].mode = InstrumentMode::poke;
  script.instruments[0].cut_width_mm = 1;
  refused(script, "cut_width_mm");
  script = snipping_script();
  script.instruments[0].opens_along.setZero();
  refused(script, "opens_along");
  script = snipping_script();
  script.instruments[0].cut_width_mm = 11;
  refused(script, "cut_width_mm");
  InstrumentTip tip = blade_at(0.5);
  tip.cut_width_mm = -1;
  Player player(organ_to_cut(), with_fem());
  EXPECT_THROW(player.step({tip}), UsageError);
}

// In through the skin, out again: a hole is left, in one piece.
TEST(PlayerCuts, ANeedleLeavesAHole) {
  Script script = cutting_script();
  InstrumentPath& needle = script.instruments[0];
  const Vector3d out = Vector3d(0.3, 1, 0.2).normalized();  // away from the anchors
  const Vector3d skin = skin_point(organ_to_cut(), out);
  needle.mode = InstrumentMode::pierce;
  needle.radius_mm = 0.6;
  needle.axis_mm = 60 * out;
  needle.path = {{0, skin + 3 * out}, {0.25, skin - 14 * out}, {0.5, skin + 6 * out}};
  script.frames = 60;
  const std::string text = script_to_json(script);
  EXPECT_EQ(script_to_json(script_from_json(text, "s")), text);
  Player player(organ_to_cut(), with_fem()), again(organ_to_cut(), with_fem());
  const std::vector<std::uint8_t> once = bytes_of(player, script);
  EXPECT_EQ(bytes_of(again, script), once);
  ASSERT_TRUE(player.is_cut());
  EXPECT_EQ(player.piece_count(), 1u);
  // As wide as the needle, where it went in.
  const TriangleMesh& now = player.bundle_now().proxy;
  double widest_mm = 0;
  for (std::size_t v = 0; v < now.vertices.size(); ++v) {
    const Vector3d from = now.vertices[v] - skin;
    if (!player.bundle_now().skin->creased[v]) continue;  // a lip, or a wall
    EXPECT_LT(std::abs(from.dot(out)), 10);
    widest_mm = std::max(widest_mm, 2 * (from - from.dot(out) * out).norm());
  }
  EXPECT_NEAR(widest_mm, 1.2, 0.6);
}

TEST(PlayerCuts, AnEmbeddedPlayersTipsSnip) {
  const TemporaryFolder folder;
  write_bundle(folder.path() / "organ", organ_to_cut());
  EmbeddedPlayer::Options options;
  options.finite_elements = true;
  EmbeddedPlayer player((folder.path() / "organ").string(), options);
  const std::size_t before = player.vertex_count();
  const Vector3d tip = bounds(organ_to_cut().proxy).center() + Vector3d(22.3, 80, 0);
  for (int i = 0; i <= 20; ++i) {
    player.step({{.position_mm = {tip.x(), tip.y(), tip.z()},
                  .radius_mm = 1,
                  .axis_mm = {0, -240, 0},
                  .snips = true,
                  .opening_mm = {0, 0, 300 - 15.0 * i}}});
  }
  for (int i = 0; i < 2 * Player::kPartingSteps; ++i) player.step({});
  EXPECT_GT(player.vertex_count(), before);
}

TEST(PlayerCuts, APieceIsCutFreeAndCarriedAway) {
  Player player(organ_to_cut(), with_fem());
  cut_in_two(player);
  ASSERT_TRUE(player.is_cut());
  ASSERT_EQ(player.piece_count(), 2u);
  Vector3d end = Vector3d::Constant(-1e9);
  for (const Vector3d& v : player.proxy_positions())
    if (v.x() > end.x()) end = v;
  const auto grab_at = [&](double share) {
    InstrumentTip tip;
    tip.active = true;
    tip.mode = InstrumentMode::grab;
    tip.radius_mm = 5;
    tip.position_mm = end + Vector3d(2 + 80 * share, 0, 0);
    return tip;
  };
  StepReport report;
  for (int i = 0; i <= 120; ++i) {
    report = player.step({grab_at(i / 120.0)});
    ASSERT_FALSE(report.recovered);
  }
  for (int i = 0; i < 60; ++i) report = player.step({grab_at(1)});
  // What was carried came along as a whole, the rest stayed.
  const double cut_x = blade_at(0).position_mm.x();
  const Bundle& now = player.bundle_now();
  double least_carried = 1e9, most_left = -1e9;
  for (std::size_t v = 0; v < now.proxy.vertices.size(); ++v) {
    const double moved = (player.proxy_positions()[v] - now.proxy.vertices[v]).x();
    const double beside = now.proxy.vertices[v].x() - cut_x;
    if (beside > 1) least_carried = std::min(least_carried, moved);
    if (beside < -1) most_left = std::max(most_left, moved);
  }
  EXPECT_GT(least_carried, 60);
  EXPECT_LT(most_left, 5);
  EXPECT_LT(report.tip_force_n[0].norm(), 1);
}

TEST(PlayerCuts, ResetMakesItWhole) {
  Player player(organ_to_cut(), with_fem());
  const Script still = short_script(0);
  const std::vector<std::uint8_t> before = bytes_of(player, still);
  cut_in_two(player);
  player.reset();
  EXPECT_FALSE(player.is_cut());
  EXPECT_EQ(player.proxy_positions().size(), organ_to_cut().proxy.vertices.size());
  EXPECT_EQ(bytes_of(player, still), before);
}

TEST(PlayerCuts, ReplaysToTheLastBit) {
  Player player(organ_to_cut(), with_fem()), other(organ_to_cut(), with_fem());
  const std::vector<std::uint8_t> once = bytes_of(player, cutting_script());
  EXPECT_EQ(player.piece_count(), 2u);
  EXPECT_EQ(bytes_of(player, cutting_script()), once);
  EXPECT_EQ(bytes_of(other, script_from_json(script_to_json(cutting_script()), "s")), once);
}

TEST(PlayerCuts, ALiveCutReplaysToTheLastBit) {
  Player player(organ_to_cut(), with_fem());
  constexpr double kStep_s = 1.0 / 60;
  LiveSession session(player, kStep_s);
  session.advance(false, 160, 120, {});
  ASSERT_TRUE(session.touch({60, 60}, InstrumentMode::cut));
  std::vector<std::uint8_t> live;
  for (int i = 0; i < 30; ++i) {
    session.drag({60 + 1.5 * i, 60});
    session.advance(true, 160, 120, {});
    const auto& pixels = session.frame().color.pixels;
    live.insert(live.end(), pixels.begin(), pixels.end());
  }
  EXPECT_TRUE(player.is_cut());
  const Script record = session.record("live");
  Player again(organ_to_cut(), with_fem());
  EXPECT_EQ(bytes_of(again, record), live);
}

// The skin shows no seam where a cut has not opened: nearly the picture of the whole organ.
TEST(PlayerCuts, AClosedCutHardlyShows) {
  Player player(organ_to_cut(), with_fem());
  const View view = orbit_view(organ_to_cut().cameras, {0.1, 0.1, 1}, 320, 240);
  Frame whole, cut;
  player.draw(view, {}, whole);
  for (int i = 0; i <= 40; ++i) {
    InstrumentTip tip = blade_at(0.5);
    tip.position_mm = bounds(organ_to_cut().proxy).center() + Vector3d(-20 + i, 0, 0);
    tip.axis_mm = 120 * organ_to_cut().cameras.manifold.directions.front();
    player.step({tip});
  }
  let_part(player);
  ASSERT_TRUE(player.is_cut());
  const DrawReport report = player.draw(view, {}, cut);
  EXPECT_EQ(report.holes_after, 0u);
  std::size_t differ = 0;
  for (std::size_t i = 0; i < whole.color.pixels.size(); ++i)
    differ += std::abs(int(whole.color.pixels[i]) - int(cut.color.pixels[i])) > 40;
  EXPECT_LT(double(differ), 0.002 * double(whole.color.pixels.size()));
}

TEST(PlayerCuts, TheProxyOfACutOrganIsTold) {
  Player player(organ_to_cut(), with_fem());
  cut_in_two(player);
  EXPECT_EQ(player.bundle_now().proxy.vertices.size(), player.proxy_positions().size());
  EXPECT_GT(player.bundle_now().proxy.faces.size(), organ_to_cut().proxy.faces.size());
  DrawOptions paper;
  paper.method = WarpMethod::paper;
  Frame frame;
  EXPECT_THROW(player.draw(orbit_view(organ_to_cut().cameras, {}, 64, 64), paper, frame),
               UsageError);
}

}  // namespace
}  // namespace organbake
