// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/motion/clip_motion.h"

#include <gtest/gtest.h>

#include "unit/motion/motion_scenes.h"

namespace organbake {
namespace {

// Tracks err by 0.3 pixels; a path of 40 mm is seen from 60.
constexpr double kPathShare = 0.005;

std::vector<const ClipPicture*> no_pictures(const std::vector<std::size_t>& frames) {
  return std::vector<const ClipPicture*>(frames.size());
}

MotionOptions plain() {
  MotionOptions options;
  options.rejoin = false;  // there are no pictures
  return options;
}

ClipMotion motion_of(const TrackedScene& tracked, const MotionOptions& options,
                     const Intrinsics& lens = hd_lens()) {
  const std::vector<double> sharpness(tracked.clip.frames, 1);
  return find_motion(options, tracked.clip, sharpness, lens, no_pictures);
}

TEST(ClipMotion, FindsThePathOfAScopeWithAGivenLens) {
  const TrackedScene tracked = tracks_of(swinging_scope(40));
  const ClipMotion motion = motion_of(tracked, plain());
  ASSERT_EQ(motion.failure, "");
  for (const auto& pose : motion.camera_from_world) EXPECT_TRUE(pose.has_value());
  EXPECT_LT(path_error(tracked.cameras, motion.camera_from_world), kPathShare);
  EXPECT_LT(motion.mean_error_px, 1);
}

TEST(ClipMotion, FindsALensThatIsNotGiven) {
  Intrinsics lens = hd_lens();
  lens.k1 = -0.05;
  const TrackedScene tracked = tracks_of(swinging_scope(40, lens));
  MotionOptions options = plain();
  options.reconstruction.lens = {.focal = true, .distortion = true};
  Intrinsics start = hd_lens();
  start.fx = start.fy = 760;
  const ClipMotion motion = motion_of(tracked, options, start);
  ASSERT_EQ(motion.failure, "");
  EXPECT_NEAR(motion.scene.lens.fx, 900, 9);
  EXPECT_NEAR(motion.scene.lens.k1, -0.05, 0.01);
  EXPECT_GT(motion.lens_spread.focal_px, 0);
  EXPECT_LT(motion.lens_spread.focal_px, 30);
  EXPECT_LT(path_error(tracked.cameras, motion.camera_from_world), 2 * kPathShare);
}

TEST(ClipMotion, IsTheSameTwice) {
  const TrackedScene tracked = tracks_of(swinging_scope(20));
  const ClipMotion a = motion_of(tracked, plain()), b = motion_of(tracked, plain());
  ASSERT_EQ(a.camera_from_world.size(), b.camera_from_world.size());
  for (std::size_t i = 0; i < a.camera_from_world.size(); ++i)
    EXPECT_EQ(a.camera_from_world[i]->translation, b.camera_from_world[i]->translation);
}

TEST(ClipMotion, TellsNoShapeOfAScopeThatStandsStill) {
  std::vector<PosedCamera> still(30, swinging_scope(2)[0]);
  const ClipMotion motion = motion_of(tracks_of(std::move(still), 0.3, 0), plain());
  EXPECT_NE(motion.failure.find("stands still"), std::string::npos) << motion.failure;
}

TEST(ClipMotion, SaysThatNothingCouldBeFollowed) {
  TrackedScene tracked = tracks_of(swinging_scope(10));
  tracked.clip.tracks.clear();
  EXPECT_NE(motion_of(tracked, plain()).failure.find("nothing can be followed"), std::string::npos);
}

TEST(ClipMotion, TellsNoShapeOfAPureTurn) {
  std::vector<PosedCamera> turning;
  for (int i = 0; i < 30; ++i) {
    PosedCamera camera{"", hd_lens(), {}};
    camera.camera_from_world.rotation =
        Eigen::AngleAxisd(0.01 * i, Eigen::Vector3d::UnitY()).toRotationMatrix();
    turning.push_back(camera);
  }
  for (const bool free : {false, true}) {
    MotionOptions options = plain();
    options.reconstruction.lens = {.focal = free, .distortion = free};
    EXPECT_NE(motion_of(tracks_of(turning, 0.3, 0), options).failure, "") << free;
  }
}

TEST(ClipMotion, TellsNoShapeOfAZoom) {
  std::vector<PosedCamera> zooming;
  for (int i = 0; i < 30; ++i) {
    PosedCamera camera{"", hd_lens(), {}};
    camera.intrinsics.fx = camera.intrinsics.fy = 900 + 10 * i;
    zooming.push_back(camera);
  }
  for (const bool free : {false, true}) {
    MotionOptions options = plain();
    options.reconstruction.lens = {.focal = free, .distortion = free};
    EXPECT_NE(motion_of(tracks_of(zooming, 0.3, 0), options).failure, "") << free;
  }
}

TEST(ClipMotion, TakesTheLongerOfTwoShots) {
  TrackedScene tracked = tracks_of(swinging_scope(40));
  const std::size_t cut = 12;
  std::vector<FeatureTrack> tracks;
  for (FeatureTrack& track : tracked.clip.tracks)
    if (track.first_frame >= cut || track.end_frame() <= cut) {
      tracks.push_back(track);
    } else {
      const auto middle =
          track.pixels.begin() + static_cast<std::ptrdiff_t>(cut - track.first_frame);
      tracks.push_back({track.first_frame, {track.pixels.begin(), middle}});
      tracks.push_back({cut, {middle, track.pixels.end()}});
    }
  tracked.clip.tracks = std::move(tracks);
  tracked.clip.shots = {0, cut};
  const ClipMotion motion = motion_of(tracked, plain());
  ASSERT_EQ(motion.failure, "");
  EXPECT_FALSE(motion.camera_from_world[5]);
  EXPECT_TRUE(motion.camera_from_world[30]);
  ASSERT_FALSE(motion.left_out.empty());
  EXPECT_EQ(motion.left_out[0].first, 0u);
}

TEST(ClipMotion, TakesPosesOfAnotherProgram) {
  const TrackedScene tracked = tracks_of(swinging_scope(20));
  std::vector<std::optional<RigidTransform>> poses;
  for (const PosedCamera& camera : tracked.cameras) poses.emplace_back(camera.camera_from_world);
  const ClipMotion motion = motion_of_poses(plain(), tracked.clip, hd_lens(), poses);
  ASSERT_EQ(motion.failure, "");
  EXPECT_GT(motion.points, 1000u);
  EXPECT_LT(motion.mean_error_px, 0.6);
}

TEST(ClipMotion, RefusesPosesOfAnotherClip) {
  const TrackedScene tracked = tracks_of(swinging_scope(20));
  std::vector<std::optional<RigidTransform>> poses;
  for (std::size_t i = 0; i < tracked.cameras.size(); ++i)
    poses.emplace_back(look_at({0, 30.0 * (i % 3), 200.0 - 20.0 * i}, {0, 0, 400}, {1, 0, 0}));
  EXPECT_NE(motion_of_poses(plain(), tracked.clip, hd_lens(), poses).failure, "");
}

}  // namespace
}  // namespace organbake
