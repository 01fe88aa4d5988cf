// SPDX-License-Identifier: GPL-3.0-or-later
#include "two_views.h"

#include <gtest/gtest.h>

#include "unit/motion/tracked_scene.h"

namespace organbake {
namespace {

TwoViews relate(const std::vector<PosedCamera>& cameras) {
  const TrackedScene tracked = tracks_of(cameras, 0.3, 0.1);
  std::vector<Eigen::Vector2d> first, second;
  for (const FeatureTrack& track : tracked.clip.tracks)
    if (track.is_in(0) && track.is_in(1)) {
      first.push_back(track.at(0).cast<double>());
      second.push_back(track.at(1).cast<double>());
    }
  return relate_views(cameras[0].intrinsics, first, second);
}

TEST(TwoViews, FindHowTheScopeMoved) {
  std::vector<PosedCamera> cameras = swinging_scope(9);
  const TwoViews views = relate({cameras[0], cameras[3]});
  const RigidTransform truth =
      cameras[3].camera_from_world * cameras[0].camera_from_world.inverse();
  EXPECT_LT((views.second_from_first.rotation - truth.rotation).norm(), 0.01);
  EXPECT_GT(views.second_from_first.translation.dot(truth.translation.normalized()), 0.995);
  EXPECT_GT(views.agreeing, 500u);
  EXPECT_GT(views.parallax_px, 2);
}

TEST(TwoViews, SeeNoParallaxInATurn) {
  std::vector<PosedCamera> cameras(2, {"", hd_lens(), {}});
  cameras[1].camera_from_world.rotation =
      Eigen::AngleAxisd(0.15, Eigen::Vector3d::UnitY()).toRotationMatrix();
  EXPECT_LT(relate(cameras).parallax_px, 2);
}

TEST(TwoViews, TellNothingOfAFewPairs) {
  const std::vector<Eigen::Vector2d> few(10, Eigen::Vector2d(1, 2));
  EXPECT_EQ(relate_views(hd_lens(), few, few).agreeing, 0u);
}

}  // namespace
}  // namespace organbake
