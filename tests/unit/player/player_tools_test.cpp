// SPDX-License-Identifier: Apache-2.0
// Scissors, hooks and needles.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "organbake/core/error.h"
#include "organbake/core/temporary_files.h"
#include "organbake/player/embedded_player.h"
#include "organbake/player/live_session.h"
#include "organbake/player/skin_point.h"
#include "organs_to_play.h"
#include "support/synthetic_bundle.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

Script snipping_script() {
  Script script = cutting_script();
  InstrumentPath& scissors = script.instruments[0];
  const Vector3d center = bounds(organ_to_cut().proxy).center();
  scissors.instrument.kind = Scissors{1.5, Vector3d(0, 0, 2)};
  scissors.path = {{0, center + Vector3d(22.3, 80, 0)}, {0.5, center + Vector3d(22.3, 80, 0)}};
  scissors.path[0].opening_mm = 300;
  scissors.instrument.axis_mm = Vector3d(0, -240, 0);
  return script;
}

TEST(PlayerTools, ScissorsCutThroughAndReplay) {
  const std::string text = script_to_json(snipping_script());
  const Script read = script_from_json(text, "s");
  EXPECT_EQ(read.instruments[0].instrument.kind, InstrumentKind(Scissors{1.5, Vector3d(0, 0, 2)}));
  EXPECT_EQ(script_to_json(read), text);
  Player player(organ_to_cut(), with_fem()), again(organ_to_cut(), with_fem());
  const std::vector<std::uint8_t> once = bytes_of(player, snipping_script());
  EXPECT_EQ(player.piece_count(), 2u);
  EXPECT_EQ(bytes_of(again, read), once);
}

TEST(PlayerTools, WhatIsForBladesAloneIsRefusedOfOthers) {
  // What is wrong once a piece of the document is another one.
  const auto refused = [](const Script& script, const std::string& from, const std::string& to,
                          const std::string& key) {
    std::string text = script_to_json(script);
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    try {
      script_from_json(text.replace(at, from.size(), to), "s");
      ADD_FAILURE() << key;
    } catch (const BadDataError& error) {
      EXPECT_NE(std::string(error.what()).find(key), std::string::npos) << error.what();
    }
  };
  const std::string snip = R"("mode": "snip")", cut = R"("mode": "cut")";
  refused(snipping_script(), snip, cut, "opens_along");
  refused(snipping_script(), R"("opens_along")", R"("shaft")", "opens_along");
  refused(snipping_script(), R"("cut_width_mm": 1.5)", R"("cut_width_mm": 11)", "cut_width_mm");
  refused(cutting_script(), cut, R"("mode": "poke", "cut_width_mm": 1)", "cut or snip alone");
  Script opening = cutting_script();
  opening.instruments[0].path[0].opening_mm = 300;
  refused(opening, cut, cut, "opening_mm");
  Instrument tip = blade_at(0.5);
  tip.kind = Blade{-1};
  Player player(organ_to_cut(), with_fem());
  EXPECT_THROW(player.step({tip}), UsageError);
}

// In through the skin, out again: a hole is left, in one piece.
TEST(PlayerTools, ANeedleLeavesAHole) {
  Script script = cutting_script();
  InstrumentPath& needle = script.instruments[0];
  const Vector3d out = Vector3d(0.3, 1, 0.2).normalized();  // away from the anchors
  const Vector3d skin = skin_place(organ_to_cut(), out).skin_mm;
  needle.instrument.kind = Needle{};
  needle.instrument.radius_mm = 0.6;
  needle.instrument.axis_mm = 60 * out;
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

TEST(PlayerTools, LiveScissorsAndAHookReplayToTheLastBit) {
  Player player(organ_to_cut(), with_fem());
  LiveSession session(player, 1.0 / 60);
  session.advance(false, 160, 120, {});
  session.turn({60, 0});  // to where nothing is anchored
  session.advance(false, 160, 120, {});
  std::vector<std::uint8_t> live;
  const auto advance = [&] {
    session.advance(true, 160, 120, {});
    const auto& pixels = session.frame().color.pixels;
    live.insert(live.end(), pixels.begin(), pixels.end());
  };
  ASSERT_TRUE(session.touch({75, 55}, Scissors{}));
  for (int i = 0; i <= 40; ++i) {  // open, and closed again
    session.drag({75.0 + std::min(i, 40 - i), 55});
    advance();
  }
  session.let_go();
  ASSERT_TRUE(session.touch({60, 70}, Blade{.cut_width_mm = 1.5}));
  for (int i = 0; i < 30; ++i) {
    session.drag({60 + 1.2 * i, 70});
    advance();
  }
  EXPECT_TRUE(player.is_cut());
  const Script record = session.record("live");
  ASSERT_EQ(record.instruments.size(), 2u);
  EXPECT_TRUE(record.instruments[0].instrument.is<Scissors>());
  EXPECT_EQ(record.instruments[1].instrument.kind, InstrumentKind(Blade{1.5}));
  Player again(organ_to_cut(), with_fem());
  EXPECT_EQ(bytes_of(again, script_from_json(script_to_json(record), "s")), live);
}

TEST(PlayerTools, AnEmbeddedPlayersTipsSnip) {
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
  for (int i = 0; i < 2 * Player::kCutDelaySteps; ++i) player.step({});
  EXPECT_GT(player.vertex_count(), before);
}

TEST(PlayerTools, AnEmbeddedPlayersTipDoesOneThing) {
  const TemporaryFolder folder;
  write_bundle(folder.path() / "organ", organ_to_cut());
  EmbeddedPlayer player((folder.path() / "organ").string());
  try {
    player.step({{}, {.grabs = true, .pierces = true}});
    FAIL() << "nobody can tell which was meant";
  } catch (const UsageError& error) {
    EXPECT_NE(std::string(error.what()).find("tip 1 "), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace organbake
