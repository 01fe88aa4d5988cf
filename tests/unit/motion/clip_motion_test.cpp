// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/motion/clip_motion.h"

#include <algorithm>
#include <array>
#include <numbers>

#include "organbake/image/srgb.h"
#include "support/testing.h"
#include "unit/motion/motion_scenes.h"

namespace organbake {
namespace {

// Tracks err by 0.3 pixels; a path of 40 mm is seen from 60.
constexpr double kPathShare = 0.005;

std::vector<const ClipPicture*> no_pictures(const std::vector<std::size_t>& frames) {
  return std::vector<const ClipPicture*>(frames.size());
}

ClipMotion motion_of(const TrackedScene& tracked, const MotionOptions& options = {},
                     const Intrinsics& lens = hd_lens()) {
  const std::vector<double> sharpness(tracked.clip.frames, 1);
  return find_motion(options, tracked.clip, sharpness, lens, no_pictures);
}

TEST(ClipMotion, FindsThePathOfAScopeWithAGivenLens) {
  const TrackedScene tracked = tracks_of(swinging_scope(40));
  const ClipMotion motion = motion_of(tracked);
  ASSERT_EQ(motion.failure, "");
  for (const auto& pose : motion.camera_from_world) EXPECT_TRUE(pose.has_value());
  EXPECT_LT(path_error(tracked.cameras, motion.camera_from_world), kPathShare);
  EXPECT_LT(motion.mean_error_px, 1);
  EXPECT_EQ(motion.scene.lens.fx, hd_lens().fx) << "a given lens is left alone";
  EXPECT_EQ(motion.lens_spread.focal_px, 0);
}

TEST(ClipMotion, FindsALensThatIsNotGiven) {
  Intrinsics lens = hd_lens();
  lens.k1 = -0.05;
  const TrackedScene tracked = tracks_of(swinging_scope(40, lens));
  MotionOptions options;
  options.lens = {.focal = true, .distortion = true};
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
  const ClipMotion a = motion_of(tracked), b = motion_of(tracked);
  ASSERT_EQ(a.camera_from_world.size(), b.camera_from_world.size());
  for (std::size_t i = 0; i < a.camera_from_world.size(); ++i)
    EXPECT_EQ(a.camera_from_world[i]->translation, b.camera_from_world[i]->translation);
}

TEST(ClipMotion, TellsNoShapeOfAScopeThatStandsStill) {
  std::vector<PosedCamera> still(30, swinging_scope(2)[0]);
  const ClipMotion motion = motion_of(tracks_of(std::move(still), 0.3, 0));
  EXPECT_NE(motion.failure.find("stands still"), std::string::npos) << motion.failure;
}

TEST(ClipMotion, DoesNotCallAFastScopeStill) {
  // Every feature is lost after one frame.
  TrackedScene tracked = tracks_of(swinging_scope(12));
  for (FeatureTrack& track : tracked.clip.tracks) track.pixels.resize(1);
  const std::string failure = motion_of(tracked).failure;
  EXPECT_EQ(failure.find("stands still"), std::string::npos) << failure;
  EXPECT_NE(failure.find("lost from one frame to the next"), std::string::npos) << failure;
}

TEST(ClipMotion, SaysNothingOfTheMotionOfOneFrame) {
  TrackedScene tracked = tracks_of(swinging_scope(2));
  for (FeatureTrack& track : tracked.clip.tracks) track.pixels.resize(1);
  tracked.clip.frames = 1;
  const ClipMotion motion = motion_of(tracked);
  EXPECT_NE(motion.failure.find("too short"), std::string::npos) << motion.failure;
  for (const FrameSpan& span : motion.left_out)
    EXPECT_EQ(span.reason.find("stands still"), std::string::npos) << span.reason;
}

TEST(ClipMotion, SaysThatNothingCouldBeFollowed) {
  TrackedScene tracked = tracks_of(swinging_scope(10));
  tracked.clip.tracks.clear();
  EXPECT_NE(motion_of(tracked).failure.find("nothing can be followed"), std::string::npos);
}

TEST(ClipMotion, TellsNoShapeOfAPureTurnOrAZoom) {
  std::vector<PosedCamera> turning(30, {"", hd_lens(), {}}), zooming = turning;
  for (int i = 0; i < 30; ++i) {
    turning[i].camera_from_world.rotation =
        Eigen::AngleAxisd(0.01 * i, Eigen::Vector3d::UnitY()).toRotationMatrix();
    zooming[i].intrinsics.fx = zooming[i].intrinsics.fy = 900 + 10 * i;
  }
  for (const auto& cameras : {turning, zooming})
    for (const bool free : {false, true}) {
      MotionOptions options;
      options.lens = {.focal = free, .distortion = free};
      EXPECT_NE(motion_of(tracks_of(cameras, 0.3, 0), options).failure, "") << free;
    }
}

// Pictures of the scene's tissue under a lamp at the lens, whose light falls off by the inverse
// square; `toward` -1 brightens what is far, which no lamp at the lens does.
struct LitClip {
  std::vector<ClipPicture> pictures;
  LitClip(const TrackedScene& tracked, double toward) {
    for (std::size_t frame = 0; frame < tracked.cameras.size(); ++frame) {
      const PosedCamera& camera = tracked.cameras[frame];
      const int width = camera.intrinsics.width, height = camera.intrinsics.height;
      ClipPicture picture;
      picture.picture.color = Rgb8Image(width, height);
      for (const FeatureTrack& track : tracked.clip.tracks) {
        if (!track.is_in(frame)) continue;
        const Eigen::Vector2f& at = track.at(frame);
        const double light = 0.3 * std::pow(60 / range_of(camera, at), 2 * toward);
        constexpr int kSpot = 9;  // what is looked at of a picture of 1280 pixels, and one more
        for (int y = std::max(0, int(at.y()) - kSpot); y < std::min(height, int(at.y()) + kSpot);
             ++y)
          for (int x = std::max(0, int(at.x()) - kSpot); x < std::min(width, int(at.x()) + kSpot);
               ++x)
            std::fill_n(picture.picture.color.at(x, y), 3,
                        srgb8_from_linear(static_cast<float>(light)));
      }
      pictures.push_back(std::move(picture));
    }
  }
  static double range_of(const PosedCamera& camera, const Eigen::Vector2f& at) {
    const RigidTransform world = camera.camera_from_world.inverse();
    const Eigen::Vector3d ray = world.rotation * unproject(camera.intrinsics, at.cast<double>());
    double depth = 60;
    for (int i = 0; i < 20; ++i) {
      const Eigen::Vector3d point = world.translation + depth * ray;
      depth += (BumpyScene().height_mm(point.x(), point.y()) - point.z()) / ray.z();
    }
    return depth * ray.norm();
  }
  PictureLoader loader() const {
    return [this](const std::vector<std::size_t>& frames) {
      std::vector<const ClipPicture*> chosen;
      for (const std::size_t frame : frames) chosen.push_back(&pictures[frame]);
      return chosen;
    };
  }
};

TEST(ClipMotion, IsOkWhereParallaxAndLampAgree) {
  const TrackedScene tracked = tracks_of(swinging_scope(14));
  const LitClip lit(tracked, 1);
  MotionOptions options;
  options.lens = {.focal = true};
  const ClipMotion motion =
      find_motion(options, tracked.clip, std::vector<double>(14, 1), hd_lens(), lit.loader());
  ASSERT_EQ(motion.failure, "");
  EXPECT_EQ(motion.quality.verdict, DepthVerdict::ok) << motion.quality.reason;
  EXPECT_LT(motion.quality.lamp_correlation, -0.9) << "nothing but the distance changes the light";
  EXPECT_NEAR(motion.quality.lamp_slope, -2, 0.2) << "the inverse square, in steps of 8 bits";
}

TEST(ClipMotion, RefusesASceneThatTheLampContradicts) {
  const TrackedScene tracked = tracks_of(swinging_scope(14));
  const LitClip lit(tracked, -1);
  const ClipMotion motion =
      find_motion({}, tracked.clip, std::vector<double>(14, 1), hd_lens(), lit.loader());
  EXPECT_EQ(motion.quality.verdict, DepthVerdict::failed);
  EXPECT_NE(motion.failure.find("contradict each other"), std::string::npos) << motion.failure;
}

// A scope that goes through a tube: of a start at 25 degrees the search ends inside out.
std::vector<PosedCamera> advancing_scope(const Intrinsics& lens) {
  std::vector<PosedCamera> cameras;
  for (int i = 0; i < 16; ++i) {
    const double t = i / 15.0;
    const Eigen::Vector3d eye(2 * std::sin(5 * t), 2 * std::cos(4 * t), 18 * t);
    cameras.push_back(
        {std::to_string(i), lens,
         look_at(eye, eye + Eigen::Vector3d(3 * std::sin(6 * t), 2 * t, 60), {0, -1, 0})});
  }
  return cameras;
}

TEST(ClipMotion, FindsTheLensFromAnyStart) {
  Intrinsics lens = hd_lens();
  lens.fx = lens.fy = 1100;
  const TrackedScene tracked = tracks_of(advancing_scope(lens));
  MotionOptions options;
  options.lens = {.focal = true, .distortion = true};
  for (const double focal_px : {450.0, 900.0, 2800.0}) {
    Intrinsics start = hd_lens();
    start.fx = start.fy = focal_px;
    const ClipMotion motion = motion_of(tracked, options, start);
    ASSERT_EQ(motion.failure, "") << focal_px;
    EXPECT_NEAR(motion.scene.lens.fx, lens.fx, 4 * motion.lens_spread.focal_px) << focal_px;
    EXPECT_LT(path_error(tracked.cameras, motion.camera_from_world), 4 * kPathShare) << focal_px;
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
  const ClipMotion motion = motion_of(tracked);
  ASSERT_EQ(motion.failure, "");
  EXPECT_FALSE(motion.camera_from_world[5]);
  EXPECT_TRUE(motion.camera_from_world[30]);
  ASSERT_FALSE(motion.left_out.empty());
  EXPECT_EQ(motion.left_out[0].first, 0u);
}

// Half of the tissue lies 5 mm deeper and 3 mm aside in these frames, which the scope's own motion
// explains in part. Features are lost, not all at once, and those found anew know nothing of it.
TrackedScene with_moved_tissue(std::size_t first, std::size_t end, std::size_t lifetime) {
  TrackedScene tracked = tracks_of(swinging_scope(44));
  std::vector<FeatureTrack> tracks;
  for (FeatureTrack& track : tracked.clip.tracks) {
    const bool moves = track.pixels.front().x() >= hd_lens().cx;
    const std::size_t phase = tracks.size();
    for (std::size_t frame = track.first_frame; frame < track.end_frame(); ++frame) {
      Eigen::Vector2f pixel = track.at(frame);
      if (moves && frame >= first && frame < end) {
        const PosedCamera& camera = tracked.cameras[frame];
        const Eigen::Vector3d ray = unproject(camera.intrinsics, pixel.cast<double>());
        const double depth = LitClip::range_of(camera, pixel) / ray.norm();
        pixel = project(camera.intrinsics, Eigen::Vector3d(depth * ray + Eigen::Vector3d(3, 0, 5)))
                    .cast<float>();
      }
      if (frame == track.first_frame || (frame + phase) % lifetime == 0)
        tracks.push_back({frame, {}});
      tracks.back().pixels.push_back(pixel);
    }
  }
  tracked.clip.tracks = std::move(tracks);
  return tracked;
}

TEST(ClipMotion, KeepsOneSpanBetweenMovesOfTheTissue) {
  struct Move {
    std::size_t first, end, lifetime;
  };
  for (const auto& [first, end, lifetime] : {Move{30, 44, 44}, {22, 44, 44}, {15, 30, 12}}) {
    SCOPED_TRACE("frames from " + std::to_string(first) + " to " + std::to_string(end));
    const TrackedScene tracked = with_moved_tissue(first, end, lifetime);
    MotionOptions options;
    options.views.most_apart = 2;
    const ClipMotion motion = motion_of(tracked, options);
    ASSERT_EQ(motion.failure, "");
    std::array<int, 3> posed = {};  // before, while, and after it has moved
    for (std::size_t frame = 0; frame < tracked.clip.frames; ++frame) {
      const bool has_pose = motion.camera_from_world[frame].has_value();
      posed[(frame >= first) + (frame >= end)] += has_pose;
      EXPECT_TRUE(has_pose || std::ranges::any_of(motion.left_out,
                                                  [&](const FrameSpan& span) {
                                                    return span.first <= frame &&
                                                           frame <= span.last;
                                                  }))
          << "nothing is said of frame " << frame;
    }
    EXPECT_EQ(std::ranges::count(posed, 0), 2);
    EXPECT_TRUE(std::ranges::any_of(motion.left_out, [](const FrameSpan& span) {
      return span.reason.find("tissue moves") != std::string::npos;
    }));
    EXPECT_LT(path_error(tracked.cameras, motion.camera_from_world), 2 * kPathShare);
  }
}

double breath_at(double frame, double period) {
  return std::pow(std::sin(std::numbers::pi * frame / period), 4);
}

Eigen::Vector3d most_of_breath(double depth_mm, double x) {
  return depth_mm * (0.2 + 0.8 / (1 + std::exp(-x / 10))) * Eigen::Vector3d(0, 1, 0.5);
}

// Tissue that is pushed down and aside as by breathing, most where x is large, by so many mm; and
// by so many frames later for each mm of x.
TrackedScene with_breath(double depth_mm, double period, double later = 0) {
  TrackedScene tracked = tracks_of(swinging_scope(80));
  tracked.clip.tracks.resize(600);
  for (FeatureTrack& track : tracked.clip.tracks)
    for (std::size_t frame = track.first_frame; frame < track.end_frame(); ++frame) {
      Eigen::Vector2f& pixel = track.pixels[frame - track.first_frame];
      const PosedCamera& camera = tracked.cameras[frame];
      const Eigen::Vector3d ray = unproject(camera.intrinsics, pixel.cast<double>());
      const Eigen::Vector3d seen = LitClip::range_of(camera, pixel) / ray.norm() * ray;
      const double x = (camera.camera_from_world.inverse() * seen).x();
      const double breath = breath_at(double(frame) - later * x, period);
      const Eigen::Vector3d pushed = breath * most_of_breath(depth_mm, x);
      pixel = project(camera.intrinsics, seen + camera.camera_from_world.rotation * pushed)
                  .cast<float>();
    }
  return tracked;
}

TEST(ClipMotion, TellsBreathFromTheScopesWay) {
  constexpr double kPeriod = 19;
  MotionOptions options;
  options.views.most_apart = 2;
  for (const double depth_mm : {0.0, 1.0}) {
    const TrackedScene tracked = with_breath(depth_mm, kPeriod);
    const ClipMotion motion = motion_of(tracked, options);
    SCOPED_TRACE(std::to_string(depth_mm) + " mm: " + motion.quality.reason);
    ASSERT_EQ(motion.failure, "");
    EXPECT_EQ(motion.quality.verdict, DepthVerdict::ok);
    EXPECT_NEAR(motion.breath_period_frames, depth_mm > 0 ? kPeriod : 0, 0.1);
    Eigen::Matrix4d truth_from_found;
    EXPECT_LT(path_error(tracked.cameras, motion.camera_from_world, &truth_from_found), 0.015);
    ASSERT_EQ(motion.scene.breath.empty(), depth_mm == 0);
    ASSERT_EQ(motion.breath.has_value(), depth_mm > 0);
    for (std::size_t view = 0; view < motion.scene.breath.size(); ++view)
      EXPECT_NEAR(motion.scene.breath[view], breath_at(double(motion.view_frames[view]), kPeriod),
                  0.1);
    if (!motion.breath) continue;
    // Where the tissue is at its most, by the field alone.
    const double most = motion.breath->course(kPeriod / 2);
    double squares = 0, places = 0;
    for (const Landmark& landmark : motion.scene.landmarks) {
      if (!landmark.place) continue;
      const auto in_truth = [&](const Eigen::Vector3d& place) -> Eigen::Vector3d {
        return (truth_from_found * place.homogeneous()).head<3>();
      };
      const Eigen::Vector3d rest = in_truth(*landmark.place),
                            pushed = in_truth(*landmark.place +
                                              most * motion.breath->push(*landmark.place));
      squares += (pushed - rest - most_of_breath(depth_mm, rest.x())).squaredNorm();
      ++places;
    }
    // Of what all tissue does alike some is taken for the scope's.
    EXPECT_LT(std::sqrt(squares / places), 0.25);  // mm, of 0.2 to 1.1
  }
}

TEST(ClipMotion, DoubtsAPathOverTissueThatBreathesInNoOneCourse) {
  MotionOptions options;
  options.views.most_apart = 2;
  const ClipMotion motion = motion_of(with_breath(1, 19, 0.2), options);
  ASSERT_EQ(motion.failure, "");
  EXPECT_EQ(motion.quality.verdict, DepthVerdict::doubtful);
  EXPECT_NE(motion.quality.reason.find("frames, as by breathing"), std::string::npos)
      << motion.quality.reason;
}

TEST(ClipMotion, TakesNoSwingOfTheScopeForBreath) {
  std::vector<PosedCamera> cameras = swinging_scope(80);
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const double swing = 15 * std::sin(2 * std::numbers::pi * double(i) / 19);
    cameras[i].intrinsics.k1 = -0.01;  // the lens that is given has none
    cameras[i].camera_from_world =
        look_at({swing, 0.1 * double(i), 0.1 * double(i)}, {0, 0, 60}, {0, -1, 0});
  }
  TrackedScene tracked = tracks_of(std::move(cameras));
  tracked.clip.tracks.resize(600);
  const ClipMotion motion = motion_of(tracked);
  ASSERT_EQ(motion.failure, "");
  EXPECT_EQ(motion.breath_period_frames, 0) << motion.quality.reason;
}

TEST(ClipMotion, TakesPosesOfAnotherProgram) {
  const TrackedScene tracked = tracks_of(swinging_scope(20));
  std::vector<std::optional<RigidTransform>> poses;
  for (const PosedCamera& camera : tracked.cameras) poses.emplace_back(camera.camera_from_world);
  const ClipMotion motion = motion_of_poses({}, tracked.clip, hd_lens(), poses, no_pictures);
  ASSERT_EQ(motion.failure, "");
  EXPECT_GT(motion.points, 1000u);
  EXPECT_LT(motion.mean_error_px, 0.6);
}

TEST(ClipMotion, RefusesPosesOfAnotherClip) {
  const TrackedScene tracked = tracks_of(swinging_scope(20));
  std::vector<std::optional<RigidTransform>> poses;
  for (std::size_t i = 0; i < tracked.cameras.size(); ++i)
    poses.emplace_back(look_at({0, 30.0 * (i % 3), 200.0 - 20.0 * i}, {0, 0, 400}, {1, 0, 0}));
  EXPECT_NE(motion_of_poses({}, tracked.clip, hd_lens(), poses, no_pictures).failure, "");
}

}  // namespace
}  // namespace organbake
