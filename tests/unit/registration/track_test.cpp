// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/registration/track.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "lamp_studio.h"
#include "organbake/core/error.h"

namespace organbake {
namespace {

constexpr double kTracked_mm = 0.3;  // a third of a pixel

// Frame by frame 2° and 2 mm on.
PosedCamera camera_at(int frame) {
  PosedCamera camera = lamp_studio().cameras[0];
  Motion motion;
  motion << 0.02 * frame, -0.02 * frame, 0.02 * frame, frame, frame, -frame;
  const Eigen::Vector3d center = lamp_studio().surface.center();
  camera.camera_from_world =
      rigid_transform(moved(object_pose(camera.camera_from_world, center), motion), center);
  return camera;
}

Rgb8Image frame_at(int frame) {
  return develop(picture_of_mesh_by_lamp(lamp_studio().surface.mesh(), camera_at(frame)),
                 {.noise = 0.01, .seed = static_cast<std::uint64_t>(frame)});
}

Rgb8Image nothing() {
  Rgb8Image image = frame_at(0);
  std::fill(image.pixels.begin(), image.pixels.end(), std::uint8_t{100});
  return image;
}

double frame_error_mm(int frame, const RegisteredPhoto& found) {
  return mtre_mm(lamp_studio().surface, camera_at(frame).camera_from_world,
                 found.camera.camera_from_world);
}

TEST(PoseTracker, FollowsAndFindsAgainWhatWasLost) {
  RegistrationOptions options;
  options.light = LightModel::camera;
  PoseTracker tracker(lamp_studio().surface, lamp_studio().cameras[0].intrinsics, options);
  tracker.start_from(camera_at(0).camera_from_world);
  for (int i = 0; i < 4; ++i) {
    const auto found = tracker.next(frame_at(i));
    EXPECT_EQ(found.quality.verdict, Verdict::ok) << i << ": " << found.quality.reason;
    EXPECT_LT(frame_error_mm(i, found), kTracked_mm) << i;
  }
  for (int i = 0; i < 2; ++i) EXPECT_NE(tracker.next(nothing()).quality.verdict, Verdict::ok);
  const auto again = tracker.next(frame_at(6));
  EXPECT_EQ(again.quality.verdict, Verdict::ok) << again.quality.reason;
  EXPECT_LT(frame_error_mm(6, again), kTracked_mm);
}

TEST(PoseTracker, RefusesFramesOfAnotherSize) {
  PoseTracker tracker(lamp_studio().surface, lamp_studio().cameras[0].intrinsics, {});
  EXPECT_THROW(tracker.next(Rgb8Image(64, 48)), BadDataError);
}

}  // namespace
}  // namespace organbake
