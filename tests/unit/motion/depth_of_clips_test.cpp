// SPDX-License-Identifier: GPL-3.0-or-later
#include "view_depths.h"

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/core/random.h"
#include "support/testing.h"
#include "unit/motion/motion_scenes.h"

namespace organbake {
namespace {

constexpr DepthRange kRange{45, 80};
constexpr int kReference = 3;

struct Clip {
  std::vector<BumpyView> views;
  std::vector<PosedFrame> frames;

  explicit Clip(const BumpyScene& scene, int width = 160) : views(bumpy_clip(scene, 7, width)) {
    for (const BumpyView& view : views) frames.push_back(frame_of(view));
  }
  std::vector<const PosedFrame*> others() const {
    std::vector<const PosedFrame*> result;
    for (int i = 0; i < static_cast<int>(frames.size()); ++i)
      if (i != kReference) result.push_back(&frames[static_cast<std::size_t>(i)]);
    return result;
  }
  const PosedFrame& reference() const { return frames[kReference]; }
  const Plane& truth() const { return views[kReference].depth_mm; }
};

TEST(PlaneSweep, FindsABumpySurfaceWithAnyNumberOfThreads) {
  const Clip clip{BumpyScene{}};
  const auto run = [&](int threads) {
    const ThreadLimit limit(threads);
    return sweep_depth(clip.reference(), clip.others(), kRange);
  };
  const SweptDepth one = run(1), four = run(4);
  // A pixel of parallax is 4 mm of depth at these baselines; a twentieth is what NCC tells.
  EXPECT_LT(median_error(one.depth, clip.truth()), 0.003);
  EXPECT_GT(known_share(one.depth), 0.95);
  EXPECT_EQ(one.depth, four.depth);
  EXPECT_EQ(one.relative_sd, four.relative_sd);
  EXPECT_EQ(one.confidence, four.confidence);
}

TEST(PlaneSweep, FollowsTheCoarserLevelsSurface) {
  const Clip clip{BumpyScene{}, 320};
  const SweptDepth swept = sweep_depth(clip.reference(), clip.others(), kRange, {}, 100);
  EXPECT_LT(median_error(swept.depth, clip.truth()), 0.002);
  EXPECT_GT(known_share(swept.depth), 0.95);
}

TEST(PlaneSweep, KnowsWhatItDoesNotKnow) {
  Clip clip{BumpyScene{.texture = 0}};
  // Without texture only shading is left, which moves with the lamp: what is said must be doubted.
  const SweptDepth bare = sweep_depth(clip.reference(), clip.others(), kRange);
  double doubt = 0;
  for (std::size_t k = 0; k < bare.depth.size(); ++k) doubt += bare.confidence.values[k];
  const Clip textured{BumpyScene{}};
  const SweptDepth good = sweep_depth(textured.reference(), textured.others(), kRange);
  double sure = 0;
  for (std::size_t k = 0; k < good.depth.size(); ++k) sure += good.confidence.values[k];
  EXPECT_GT(sure, 0.7 * double(good.depth.size()));
  EXPECT_LT(doubt, 0.3 * sure);
}

TEST(PlaneSweep, LeavesOutWhatDoesNotCount) {
  Clip clip{BumpyScene{}};
  // A highlight that stands still in every picture would be matched at infinity.
  for (PosedFrame& frame : clip.frames)
    for (int y = 50; y < 70; ++y)
      for (int x = 70; x < 100; ++x) {
        frame.intensity.at(x, y) = (x + y) % 7 < 3 ? 255.F : 200.F;
        frame.counts.at(x, y) = 0;
      }
  const SweptDepth swept = sweep_depth(clip.reference(), clip.others(), kRange);
  for (int y = 50; y < 70; ++y)
    for (int x = 70; x < 100; ++x) ASSERT_FALSE(std::isfinite(swept.depth.at(x, y)));
  EXPECT_LT(median_error(swept.depth, clip.truth()), 0.003);
}

struct Swept {
  std::vector<PosedCamera> cameras;
  std::vector<std::vector<std::size_t>> partners;
  std::vector<SweptDepth> depths;

  explicit Swept(int frames = 4, float confidence = 0.5F) {
    const std::vector<BumpyView> views = bumpy_clip(BumpyScene{}, frames);
    for (const BumpyView& view : views) {
      const int width = view.depth_mm.width, height = view.depth_mm.height;
      cameras.push_back(view.camera);
      depths.push_back(
          {view.depth_mm, Plane(width, height, 0.004F), Plane(width, height, confidence)});
    }
    for (std::size_t i = 0; i < views.size(); ++i) {
      partners.emplace_back();
      for (std::size_t j = 0; j < views.size(); ++j)
        if (j != i) partners.back().push_back(j);
    }
  }
};

TEST(Agreement, RaisesWhatPartnersConfirm) {
  Swept swept;
  check_agreement(swept.cameras, swept.partners, swept.depths);
  for (const SweptDepth& depth : swept.depths) EXPECT_GT(depth.confidence.at(80, 60), 0.75F);
}

TEST(Agreement, LowersWhatWouldHideWhatPartnersSee) {
  Swept swept;
  const auto spoil = [](Plane& depth, float factor) {
    for (int y = 50; y < 70; ++y)
      for (int x = 70; x < 90; ++x) depth.at(x, y) *= factor;
  };
  spoil(swept.depths[0].depth, 0.8F);
  spoil(swept.depths[3].depth, 1.2F);
  check_agreement(swept.cameras, swept.partners, swept.depths);
  EXPECT_LT(swept.depths[0].confidence.at(80, 60), 0.25F) << "in front of what others see";
  EXPECT_LT(swept.depths[3].confidence.at(80, 60), 0.5F) << "behind what all others see";
  EXPECT_GT(swept.depths[0].confidence.at(80, 20), 0.75F);
}

TEST(Agreement, StaysWhereNobodyLooks) {
  Swept swept;
  for (std::vector<std::size_t>& none : swept.partners) none.clear();
  check_agreement(swept.cameras, swept.partners, swept.depths);
  EXPECT_EQ(swept.depths[0].confidence.at(80, 60), 0.5F);
}

TEST(Agreement, LendsWhatAFrameDoesNotKnow) {
  Swept all(3, 0.9F);
  std::vector<SweptDepth>& swept = all.depths;
  const std::vector<SweptDepth> truth = swept;
  const int width = truth[0].depth.width, height = truth[0].depth.height;
  // The middle frame knows nothing of its middle; the last one doubts its own, which is wrong.
  Mask hole(width, height);
  for (int y = 40; y < 80; ++y)
    for (int x = 60; x < 100; ++x) {
      hole.at(x, y) = 1;
      swept[1].depth.at(x, y) = std::numeric_limits<float>::infinity();
      swept[1].confidence.at(x, y) = 0;
    }
  for (float& depth : swept[2].depth.values) depth *= 1.3F;
  swept[2].confidence = Plane(width, height, 0.3F);
  borrow_depth(all.cameras, all.partners, swept);
  EXPECT_LT(median_error(swept[1].depth, truth[1].depth, hole), 0.01);
  int filled = 0, wanted = 0;
  for (std::size_t k = 0; k < hole.size(); ++k) {
    if (!hole.values[k]) continue;
    ++wanted;
    filled += swept[1].confidence.values[k] > 0;
    EXPECT_LT(swept[1].confidence.values[k], 0.9F) << "lent depth is less sure than its lender's";
  }
  EXPECT_GT(filled, 0.7 * wanted);
  EXPECT_EQ(swept[0].depth, truth[0].depth) << "who is sure borrows nothing";
  EXPECT_LT(median_error(swept[2].depth, truth[2].depth), 0.01);
}

PosedCamera camera_at(double x_mm, double y_mm = 0) {
  Intrinsics lens;
  lens.width = 160, lens.height = 120;
  lens.fx = lens.fy = 150, lens.cx = 80, lens.cy = 60;
  return {.name = {},
          .intrinsics = lens,
          .camera_from_world = look_at({x_mm, y_mm, 0}, {x_mm, y_mm, 60}, {0, -1, 0})};
}

bool holds(const std::vector<std::size_t>& list, std::size_t index) {
  return std::find(list.begin(), list.end(), index) != list.end();
}

TEST(Neighbours, TakesTheBestAnglesFirst) {
  // 4.8 mm at 60 mm are the best 0.08 rad.
  const std::vector<PosedCamera> cameras = {camera_at(0), camera_at(0.1), camera_at(1),
                                            camera_at(4.8), camera_at(15)};
  const std::vector<std::size_t> found = best_neighbours(cameras, 0, 60);
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found.front(), 3u);
  EXPECT_FALSE(holds(found, 0)) << "a frame is no neighbour of itself";
  EXPECT_FALSE(holds(found, 1)) << "0.1 mm tell nothing of depth";
}

TEST(Neighbours, LeavesOutWhoLooksElsewhere) {
  std::vector<PosedCamera> cameras = {camera_at(0), camera_at(5), camera_at(5)};
  cameras[2].camera_from_world = look_at({5, 0, 0}, {65, 0, 10}, {0, -1, 0});
  EXPECT_EQ(best_neighbours(cameras, 0, 60), std::vector<std::size_t>{1});
}

TEST(Neighbours, LooksFromSeveralSides) {
  std::vector<PosedCamera> cameras = {camera_at(0)};
  for (int i = 0; i < 6; ++i) cameras.push_back(camera_at(4.8 + 0.05 * i));
  cameras.push_back(camera_at(-3.5));
  cameras.push_back(camera_at(0, 3.5));
  const std::vector<std::size_t> found = best_neighbours(cameras, 0, 60, {.most = 3});
  ASSERT_EQ(found.size(), 3u);
  EXPECT_TRUE(holds(found, 7) && holds(found, 8));
}

TEST(Neighbours, PrefersThoseNearInTime) {
  std::vector<PosedCamera> cameras;
  for (int i = 0; i < 40; ++i) cameras.push_back(camera_at(i % 2 ? 4.8 : 0));
  const std::vector<std::size_t> found =
      best_neighbours(cameras, 20, 60, {.most = 2, .usual_gap = 4});
  EXPECT_EQ(found.size(), 2u);
  for (const std::size_t i : found) EXPECT_LE(i > 20 ? i - 20 : 20 - i, 3u);
}

// Glossy tissue: parallax is sure round it and tells nothing on the dome in its middle.
struct GlossyDome {
  BumpyView view;
  PreparedFrame frame;
  SweptDepth swept;
  Mask hole;

  explicit GlossyDome(double hole_px = 28) {
    const BumpyScene scene{.bump_mm = 5, .texture = 0};
    view = bumpy_clip(scene, 1)[0];
    frame = prepared_of(view);
    const int width = view.light.width, height = view.light.height;
    swept = {view.depth_mm, Plane(width, height, 0.005F), Plane(width, height, 0.8F)};
    hole = Mask(width, height);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        if (std::hypot(x - 0.5 * width, y - 0.5 * height) >= hole_px) continue;
        hole.at(x, y) = 1;
        swept.confidence.at(x, y) = 0;
        swept.depth.at(x, y) = std::numeric_limits<float>::infinity();
      }
  }
};

TEST(HeldShading, GivesAGlossyDomeItsCurvature) {
  const GlossyDome dome;
  const FrameDepth shaded = fill_by_shading(dome.frame, dome.swept, 0.4);
  PreparedFrame blind = dome.frame;
  blind.diffuse = Mask(blind.diffuse.width, blind.diffuse.height);
  const FrameDepth bridged = fill_by_shading(blind, dome.swept, 0.4);
  const double with = median_error(shaded.depth, dome.view.depth_mm, dome.hole);
  const double without = median_error(bridged.depth, dome.view.depth_mm, dome.hole);
  EXPECT_LT(with, 0.6 * without) << "bridged " << without;
  EXPECT_LT(with, 0.012);
}

TEST(HeldShading, TakesNoSlowChangeFromBrightness) {
  GlossyDome dome(0);
  // A beam that lights the left three times as much as the right.
  for (int y = 0; y < dome.hole.height; ++y)
    for (int x = 0; x < dome.hole.width; ++x)
      dome.frame.intensity.at(x, y) *= std::exp(-1.1F * float(x) / float(dome.hole.width));
  const FrameDepth depth = fill_by_shading(dome.frame, dome.swept);
  EXPECT_LT(median_error(depth.depth, dome.view.depth_mm), 0.004);
}

TEST(HeldShading, LetsStrayMatchesGo) {
  GlossyDome dome(0);
  RandomStream random(5, 0);
  for (float& depth : dome.swept.depth.values)
    if (random.uniform() < 0.1) depth *= static_cast<float>(0.6 + 0.8 * random.uniform());
  const FrameDepth depth = fill_by_shading(dome.frame, dome.swept);
  EXPECT_LT(median_error(depth.depth, dome.view.depth_mm), 0.006);
  EXPECT_GT(known_share(depth.depth), 0.99);
}

TEST(HeldShading, SaysNothingFarFromParallax) {
  GlossyDome dome;
  for (int y = 0; y < dome.hole.height; ++y)
    for (int x = 40; x < dome.hole.width; ++x) dome.swept.confidence.at(x, y) = 0;
  const FrameDepth depth = fill_by_shading(dome.frame, dome.swept);
  EXPECT_TRUE(std::isfinite(depth.depth.at(20, 60)));
  EXPECT_FALSE(std::isfinite(depth.depth.at(140, 60)));
  EXPECT_EQ(depth.confidence.at(140, 60), 0);
}

TEST(HeldShading, RefusesWhatItCannotHold) {
  GlossyDome dome;
  dome.swept.confidence = Plane(dome.hole.width, dome.hole.height);
  EXPECT_THROW(fill_by_shading(dome.frame, dome.swept), BadDataError);
}

}  // namespace
}  // namespace organbake
