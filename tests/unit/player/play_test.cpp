// SPDX-License-Identifier: Apache-2.0
#include "organbake/player/script.h"

#include "organbake/bundle/json_fields.h"
#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/core/temporary_files.h"
#include "organbake/image/png.h"
#include "organbake/player/carried_surface.h"
#include "organbake/player/contact_sheet.h"
#include "organbake/player/embedded_player.h"
#include "organbake/player/live_session.h"
#include "organbake/player/orbit.h"
#include "organbake/player/skin_point.h"
#include "organs_to_play.h"
#include "support/error_message.h"
#include "support/organs.h"
#include "support/testing.h"

namespace organbake {
namespace {

PlayOptions small_frames() {
  PlayOptions options;
  options.width = 120;
  options.height = 90;
  return options;
}

std::vector<Rgb8Image> frames_of(const Script& script, int threads) {
  const ThreadLimit limit(threads);
  Player player(organ_to_play());
  std::vector<Rgb8Image> frames;
  play(player, script, small_frames(), [&](int, const Frame& f) { frames.push_back(f.color); });
  return frames;
}

TEST(PlayOptions, DefaultsAreValidAndEmptyPicturesAreNot) {
  EXPECT_NO_THROW(PlayOptions().check());
  PlayOptions o;
  o.width = 0;
  EXPECT_THROW(o.check(), UsageError);
  o.width = 20000;
  EXPECT_THROW(o.check(), UsageError);
}

TEST(Play, GivesTheSameBytesForAnyNumberOfThreads) {
  const auto one = frames_of(short_script(10), 1), two = frames_of(short_script(10), 2);
  ASSERT_EQ(one.size(), 8u);
  for (std::size_t i = 0; i < one.size(); ++i) EXPECT_EQ(one[i].pixels, two[i].pixels) << i;
}

TEST(Play, ReportsEveryFrame) {
  Player player(organ_to_play());
  const Script script = short_script(8);
  const auto played = play(player, script, small_frames(), {});
  const Json report = parse_json(play_report(script, player, played), "report");
  EXPECT_EQ(report["schema"], "organbake/play-report/1");
  ASSERT_EQ(report["frames"].size(), 8u);
  EXPECT_GT(report["frames"][0]["pixels"]["from_samples"].get<int>(), 0);
  // Where the probe touches, the tissue pushes it back out, towards the eye at camera 0.
  std::size_t touching = 0;
  for (const PlayedFrame& frame : played) {
    if (frame.step.contacts == 0) continue;
    ++touching;
    EXPECT_GT(frame.step.tip_force_n[0].dot(organ_to_play().cameras.manifold.directions[0]), 0);
  }
  EXPECT_GT(touching, 0u);
}

// What another solver tells is shown, and again from its begin.
TEST(Play, MovesVerticesAsAScriptTells) {
  Player player(organ_to_play());
  const auto& rest = organ_to_play().proxy.vertices;
  Script script = short_script(8);
  script.name = "moved";
  script.instruments.clear();
  for (const double by_mm : {0.0, 2.0, 5.0}) {
    script.vertices_mm.emplace_back();
    for (const Eigen::Vector3d& vertex : rest)
      for (const double x : {vertex.x() + by_mm, vertex.y(), vertex.z()})
        script.vertices_mm.back().push_back(x);
  }
  script.camera.resize(1);
  std::vector<Rgb8Image> frames;
  play(player, script, small_frames(), [&](int frame, const Frame& picture) {
    frames.push_back(picture.color);
    const double by_mm = std::array{0.0, 2.0, 5.0}[std::size_t(frame) % 3];
    for (std::size_t v = 0; v < rest.size(); ++v)
      EXPECT_EQ(player.proxy_positions()[v], rest[v] + Eigen::Vector3d(by_mm, 0, 0));
  });
  ASSERT_EQ(frames.size(), 8u);
  EXPECT_EQ(frames[1].pixels, frames[4].pixels);
  EXPECT_NE(frames[1].pixels, frames[2].pixels);
  script.vertices_mm[1].resize(6);
  EXPECT_EQ(
      message_of(ExitCode::usage, [&] { play(player, script, small_frames(), {}); }),
      "script 'moved': /vertices_mm/1: 2 vertices for an organ of " + std::to_string(rest.size()));
}

TEST(Play, StopsWhenAsked) {
  const std::atomic<bool> stop{true};
  Player player(organ_to_play());
  EXPECT_THROW(play(player, short_script(8), small_frames(), {}, RunContext({}, {}, &stop)),
               CancelledError);
}

TEST(ContactSheet, TilesWhatItIsGiven) {
  Rgb8Image red(4, 3);
  for (int i = 0; i < 12; ++i) red.pixels[3 * i] = 255;
  const Rgb8Image sheet = tile_pictures({red, red, red}, 2, 1);
  EXPECT_EQ(sheet.width, 2 * 4 + 3);
  EXPECT_EQ(sheet.height, 2 * 3 + 3);
  EXPECT_EQ(sheet.at(1, 1)[0], 255);
  EXPECT_EQ(sheet.at(1, 5)[0], 255);
  EXPECT_EQ(sheet.at(6, 5)[0], 48);  // the fourth place stays empty
}

Rgb8Image grey_picture(std::uint8_t level) {
  Rgb8Image picture(8, 6);
  std::fill(picture.pixels.begin(), picture.pixels.end(), level);
  return picture;
}

class ReferenceFramesTest : public testing::Test {
 protected:
  ReferenceFramesTest() {
    for (int i = 0; i < 3; ++i) write_png(folder_.path() / frame_file_name(i), grey_picture(100));
  }
  TemporaryFolder folder_;
};

TEST_F(ReferenceFramesTest, EqualFramesPassAnyThreshold) {
  ReferenceFrames reference(folder_.path(), 3);
  for (int i = 0; i < 3; ++i) reference.compare(i, grey_picture(100));
  EXPECT_TRUE(std::isinf(reference.least_psnr_db()));
  EXPECT_NO_THROW(reference.check(1000));
}

TEST_F(ReferenceFramesTest, TheWorstFrameDecides) {
  ReferenceFrames reference(folder_.path(), 3);
  reference.compare(0, grey_picture(101));
  reference.compare(1, grey_picture(110));
  reference.compare(2, grey_picture(100));
  EXPECT_NEAR(reference.least_psnr_db(), 20 * std::log10(255.0 / 10), 1e-9);
  EXPECT_EQ(reference.worst_frame(), 1);
  EXPECT_NO_THROW(reference.check(28));
  try {
    reference.check(29);
    FAIL() << "10 levels off are 28.13 dB";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ExitCode::quality_gate);
    EXPECT_NE(std::string(error.what()).find("frame_0001.png"), std::string::npos);
  }
}

TEST_F(ReferenceFramesTest, RefusesWhatCannotBeCompared) {
  EXPECT_THROW(ReferenceFrames(folder_.path() / "none", 3), NoInputError);
  EXPECT_THROW(ReferenceFrames(folder_.path(), 4), BadDataError);
  EXPECT_THROW(ReferenceFrames(folder_.path(), 2), BadDataError);
  ReferenceFrames reference(folder_.path(), 3);
  EXPECT_THROW(reference.compare(0, Rgb8Image(6, 8)), BadDataError);
}

class CarriedSurfaceTest : public testing::Test {
 protected:
  CarriedSurface truth_{organ_options().organ.mesh(4), organ_to_play().shell()};
  View view_ = orbit_view(organ_to_play().cameras, {}, 96, 96);
};

TEST_F(CarriedSurfaceTest, RestsWhereItWas) {
  const auto carried = truth_.carry(organ_to_play().proxy.vertices);
  constexpr double kRoundingMm = 1e-6;
  for (std::size_t v = 0; v < carried.size(); ++v) {
    EXPECT_LT((carried[v] - truth_.at_rest().vertices[v]).norm(), kRoundingMm);
  }
}

TEST_F(CarriedSurfaceTest, SeesTheHalfThatFacesTheEye) {
  const auto& rest = truth_.at_rest().vertices;
  const auto seen = truth_.visible(rest, view_);
  const Eigen::Vector3d center = organ_options().organ.center,
                        to_eye = (view_.camera.center_world_mm() - center).normalized();
  for (std::size_t v = 0; v < rest.size(); ++v) {
    const double side = (rest[v] - center).normalized().dot(to_eye);
    if (side > 0.6) {
      EXPECT_TRUE(seen[v]) << v;
    }
    if (side < -0.1) {
      EXPECT_FALSE(seen[v]) << v;
    }
  }
}

TEST_F(CarriedSurfaceTest, DrawsRaysInsideAndOutside) {
  const TruthFrame frame = truth_.draw(truth_.at_rest().vertices, view_, {10, 20, 30});
  EXPECT_EQ(frame.covered[0], 0);
  EXPECT_EQ(frame.color.at(0, 0)[1], 20);
  const std::size_t middle = 48 * 96 + 48;
  EXPECT_EQ(frame.covered[middle], TruthFrame::kRaysPerPixel);
  EXPECT_LT(frame.shell_face[middle], organ_to_play().proxy.faces.size());
  const auto partly = std::count_if(frame.covered.begin(), frame.covered.end(), [](int rays) {
    return rays > 0 && rays < TruthFrame::kRaysPerPixel;
  });
  EXPECT_GT(partly, 50);  // a silhouette of some 200 pixels is smooth
}

TEST_F(CarriedSurfaceTest, RefusesWhatItCannotShow) {
  EXPECT_THROW(CarriedSurface(TriangleMesh(), organ_to_play().shell()), BadDataError);
  TriangleMesh grey = truth_.at_rest();
  grey.colors.clear();
  const CarriedSurface colourless(grey, organ_to_play().shell());
  EXPECT_THROW(colourless.draw(grey.vertices, view_, {0, 0, 0}), BadDataError);
}

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
    EXPECT_THAT(message_of(ExitCode::bad_data,
                           [&] { script_from_json(text.replace(at, from.size(), to), "s"); }),
                testing::HasSubstr(key));
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
  EXPECT_THAT(message_of(ExitCode::usage,
                         [&] {
                           player.step({{}, {.grabs = true, .pierces = true}});
                         }),
              testing::HasSubstr("tip 1 "));
}

}  // namespace
}  // namespace organbake
