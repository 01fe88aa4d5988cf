// SPDX-License-Identifier: Apache-2.0
#include "organbake/player/play.h"

#include <gtest/gtest.h>

#include "organ_to_play.h"
#include "organbake/bundle/json_fields.h"
#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/player/contact_sheet.h"

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

TEST(Play, APokeMovesTheProxyAndTheReleaseBringsItBack) {
  Player player(organ_to_play());
  const auto rest = player.proxy_positions();
  hold_poke(player, organ_to_play().cameras.manifold.directions[0], 0.2, 6);
  double moved = 0;
  for (std::size_t v = 0; v < rest.size(); ++v) {
    moved = std::max(moved, (player.proxy_positions()[v] - rest[v]).norm());
  }
  EXPECT_GT(moved, 1);  // of a 90 mm body pressed in by 18 mm
  player.reset();
  EXPECT_EQ(player.proxy_positions(), rest);
}

TEST(Play, ReportsEveryFrame) {
  Player player(organ_to_play());
  const Script script = short_script(8);
  const auto played = play(player, script, small_frames(), {});
  const Json report = parse_json(play_report(script, player, played), "report");
  EXPECT_EQ(report["schema"], "organbake/play-report/1");
  ASSERT_EQ(report["frames"].size(), 8u);
  EXPECT_EQ(report["frames"][0]["holes_after_fill"].get<int>(), 0);
  // Where the probe touches, the tissue pushes it back out, towards the eye at camera 0.
  std::size_t touching = 0;
  for (const PlayedFrame& frame : played) {
    if (frame.step.contacts == 0) continue;
    ++touching;
    EXPECT_GT(frame.step.tip_force_n[0].dot(organ_to_play().cameras.manifold.directions[0]), 0);
  }
  EXPECT_GT(touching, 0u);
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

}  // namespace
}  // namespace organbake
