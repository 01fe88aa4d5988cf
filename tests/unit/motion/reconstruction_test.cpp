// SPDX-License-Identifier: GPL-3.0-or-later
#include "two_views.h"

#include "organbake/core/error.h"
#include "organbake/motion/key_depths.h"
#include "organbake/motion/scene.h"
#include "organbake/shading/masks.h"
#include "support/testing.h"
#include "unit/motion/motion_scenes.h"

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

// The scene as it is, its landmarks placed from their tracks.
Scene true_scene(const TrackedScene& tracked) {
  Scene scene = posed_scene(tracked);
  triangulate(scene);
  return scene;
}

TEST(Triangulation, PutsLandmarksOnTheTissue) {
  const Scene scene = true_scene(tracks_of(swinging_scope(10), 0.0, 0));
  std::size_t placed = 0;
  for (const Landmark& landmark : scene.landmarks) {
    if (!landmark.place) continue;
    ++placed;
    const double height = BumpyScene().height_mm(landmark.place->x(), landmark.place->y());
    EXPECT_NEAR(landmark.place->z(), height, 0.01) << "tracks are floats";
  }
  EXPECT_GT(placed, scene.landmarks.size() * 9 / 10);
}

TEST(Triangulation, LeavesWhatIsSeenUnderTooSmallAnAngle) {
  std::vector<PosedCamera> near(2, swinging_scope(2)[0]);
  near[1].camera_from_world.translation.x() += 0.2;  // 0.2 degrees at 60 mm
  const Scene scene = true_scene(tracks_of(std::move(near), 0.0, 0));
  for (const Landmark& landmark : scene.landmarks) EXPECT_FALSE(landmark.place);
}

TEST(Triangulation, DropsSightingsThatDoNotAgree) {
  Scene scene = true_scene(tracks_of(swinging_scope(10), 0.0, 0));
  Landmark& landmark =
      *std::find_if(scene.landmarks.begin(), scene.landmarks.end(),
                    [](const Landmark& one) { return one.place && one.seen.size() == 10; });
  landmark.seen[4].pixel.x() += 20;
  drop_outliers(scene);
  ASSERT_TRUE(landmark.place);
  EXPECT_FALSE(landmark.seen[4].agrees);
  EXPECT_TRUE(landmark.seen[5].agrees);
}

TEST(BundleAdjustment, BringsShakenPosesBack) {
  const TrackedScene tracked = tracks_of(swinging_scope(10), 0.0, 0);
  Scene scene = true_scene(tracked);
  for (std::size_t view = 2; view < scene.camera_from_world.size(); ++view)
    scene.camera_from_world[view]->translation += Eigen::Vector3d(0.3, -0.2, 0.1);
  adjust({.iterations = 50, .tolerance = 1e-10}, scene);
  EXPECT_LT(path_error(tracked.cameras, scene.camera_from_world), 1e-3);
}

TEST(BundleAdjustment, PosesOneViewAlone) {
  const TrackedScene tracked = tracks_of(swinging_scope(6), 0.0, 0);
  const Scene scene = true_scene(tracked);
  SeenPlaces seen;
  for (const Landmark& landmark : scene.landmarks)
    if (const Sighting* sighting = sighting_in(landmark, 3); sighting && landmark.place) {
      seen.places.push_back(*landmark.place);
      seen.pixels.push_back(sighting->pixel);
    }
  // One that lies behind the camera hinders none of the others.
  seen.places.push_back(-2 * seen.places.front());
  seen.pixels.push_back(seen.pixels.front());
  RigidTransform pose = *scene.camera_from_world[2];
  ASSERT_LT((pose * seen.places.back()).z(), 0);
  EXPECT_GT(adjust_pose(scene.lens, seen, pose), seen.places.size() * 9 / 10);
  EXPECT_LT((pose.translation - scene.camera_from_world[3]->translation).norm(), 1e-2);
}

constexpr double kMmPerUnit = 10;

// Key frames of a bumpy scene whose unit is a centimetre.
struct ScaledClip {
  std::vector<BumpyView> views = bumpy_clip({}, 3, 320);
  ClipMotion motion;
  std::vector<KeyDepth> keys;

  ScaledClip() {
    motion.scene.lens = views[0].camera.intrinsics;
    for (std::size_t i = 0; i < views.size(); ++i) {
      RigidTransform pose = views[i].camera.camera_from_world;
      pose.translation /= kMmPerUnit;
      motion.camera_from_world.emplace_back(pose);
      KeyDepth key;
      key.frame = i;
      key.prepared = prepared_of(views[i]);
      key.camera_from_world = pose;
      key.depth.depth = views[i].depth_mm;
      for (float& z : key.depth.depth.values) z /= static_cast<float>(kMmPerUnit);
      keys.push_back(std::move(key));
    }
  }

  Eigen::Vector3d place_mm(std::size_t frame, const Eigen::Vector2d& pixel) const {
    return unproject(views[frame].camera.intrinsics, pixel) *
           double(views[frame].depth_mm.at(int(pixel.x()), int(pixel.y())));
  }
};

TEST(KnownScale, TakesTheDistanceOfTwoPlaces) {
  const ScaledClip clip;
  const Eigen::Vector2d first(60.5, 80.5), second(250.5, 150.5);
  const double apart = (clip.place_mm(0, first) - clip.place_mm(0, second)).norm();
  const KnownScale scale = scale_by_distance({0, first, second, apart}, clip.motion, clip.keys);
  // Depth is looked up within a pixel or so.
  EXPECT_NEAR(scale.mm_per_unit, kMmPerUnit, 0.01 * kMmPerUnit);
  EXPECT_EQ(scale.frames, 3u);
  EXPECT_GT(scale.relative_sd, 0);
  EXPECT_LT(scale.relative_sd, 0.03);
}

TEST(KnownScale, SaysWhatIsWrongWithADistance) {
  EXPECT_EQ(parse_known_distance("7,1,2.5,3,4,10").frame, 7u);
  for (const char* bad :
       {"", "7", "7,1,2,3,4", "7,1,2,3,4,0", "7,1,2,3,4,-1", "7.5,1,2,3,4,10", "-1,1,2,3,4,10",
        "7,1,2,3,4,10,11", "7,a,2,3,4,10", "7,1,2,1,2,10", "7 1 2 3 4 10"})
    EXPECT_THROW(parse_known_distance(bad), UsageError) << bad;
  const ScaledClip clip;
  EXPECT_THROW(scale_by_distance({9, {1, 1}, {2, 2}, 5}, clip.motion, clip.keys), UsageError);
  EXPECT_THROW(scale_by_distance({0, {1, 1}, {9999, 2}, 5}, clip.motion, clip.keys), UsageError);
}

// Where a ray meets a round shaft of 5 mm that ends at `tip` (camera axes, mm).
bool meets_shaft(const Eigen::Vector3d& ray, const Eigen::Vector3d& tip,
                 const Eigen::Vector3d& towards) {
  constexpr double kRadius = 2.5;
  const Eigen::Vector3d across = ray - ray.dot(towards) * towards;
  const Eigen::Vector3d beside = -tip + tip.dot(towards) * towards;
  const double a = across.squaredNorm(), b = across.dot(beside);
  const double root2 = b * b - a * (beside.squaredNorm() - kRadius * kRadius);
  if (root2 < 0) return false;
  const double t = (-b - std::sqrt(root2)) / a;
  return t > 0 && (t * ray - tip).dot(towards) >= 0;
}

void put_shaft(const ScaledClip& clip, std::size_t frame, KeyDepth& key) {
  const Intrinsics& lens = key.prepared.camera;
  const Eigen::Vector3d tip = clip.place_mm(frame, {0.5 * lens.width, 0.5 * lens.height});
  const Eigen::Vector3d towards = Eigen::Vector3d(50, 12, -30).normalized();
  Mask shaft(lens.width, lens.height);
  for (int y = 0; y < lens.height; ++y)
    for (int x = 0; x < lens.width; ++x) {
      shaft.at(x, y) = meets_shaft(unproject(lens, {x + 0.5, y + 0.5}), tip, towards);
      const std::uint8_t steel[] = {190, 190, 195}, tissue[] = {120, 50, 45};
      std::copy_n(shaft.at(x, y) ? steel : tissue, 3, key.prepared.color.at(x, y));
    }
  key.prepared.instruments = dilated(shaft, 2);
}

TEST(KnownScale, TakesTheDiameterOfAShaft) {
  ScaledClip clip;
  for (std::size_t i = 0; i < clip.keys.size(); ++i) put_shaft(clip, i, clip.keys[i]);
  const KnownScale scale = scale_by_shaft(5, clip.keys);
  // 25 pixels wide, its outlines found to a third of one; the tip lies on uneven tissue.
  EXPECT_NEAR(scale.mm_per_unit, kMmPerUnit, 0.05 * kMmPerUnit);
  EXPECT_GT(scale.relative_sd, 0);
  EXPECT_LT(scale.relative_sd, 0.15);
}

TEST(KnownScale, KnowsNoneWithoutAShaft) {
  const ScaledClip clip;
  EXPECT_THROW(scale_by_shaft(5, clip.keys), BadDataError);
}

}  // namespace
}  // namespace organbake
