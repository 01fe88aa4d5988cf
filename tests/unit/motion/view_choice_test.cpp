// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/motion/view_choice.h"

#include <gtest/gtest.h>

#include "unit/motion/tracked_scene.h"

namespace organbake {
namespace {

TEST(ViewChoice, TakesMoreViewsWhereTheScopeMovesFaster) {
  const ClipTracks clip = tracks_of(swinging_scope(60)).clip;
  const std::vector<double> sharpness(clip.frames, 1);
  const auto coarse = choose_views({.motion_share = 0.05}, clip, sharpness, 0, clip.frames);
  const auto fine = choose_views({.motion_share = 0.01}, clip, sharpness, 0, clip.frames);
  EXPECT_LT(coarse.size(), fine.size());
  EXPECT_EQ(coarse.front(), 0u);
}

TEST(ViewChoice, PassesOverBlurredFrames) {
  const ClipTracks clip = tracks_of(swinging_scope(60)).clip;
  std::vector<double> sharpness(clip.frames, 1);
  for (std::size_t frame = 1; frame < sharpness.size(); frame += 2) sharpness[frame] = 0.1;
  const auto views = choose_views({.motion_share = 0.05}, clip, sharpness, 0, clip.frames);
  for (std::size_t i = 1; i + 1 < views.size(); ++i) EXPECT_EQ(views[i] % 2, 0u);
}

TEST(ViewChoice, KeepsToItsMost) {
  const ClipTracks clip = tracks_of(swinging_scope(100)).clip;
  const std::vector<double> sharpness(clip.frames, 1);
  EXPECT_LE(choose_views({.motion_share = 0.001, .most_views = 20}, clip, sharpness, 0, clip.frames)
                .size(),
            20u);
}

TEST(ViewChoice, IsTheSameWhileTheClipIsRead) {
  const ClipTracks clip = tracks_of(swinging_scope(60)).clip;
  const std::vector<double> sharpness(clip.frames, 1);
  const ViewChoice choice{.motion_share = 0.02};
  std::vector<std::size_t> views = {0};
  for (std::size_t end = 1; end <= clip.frames; ++end)
    while (const auto view =
               next_view(choice, clip, sharpness, views.back(), end, end == clip.frames))
      views.push_back(*view);
  EXPECT_EQ(views, choose_views(choice, clip, sharpness, 0, clip.frames));
}

}  // namespace
}  // namespace organbake
