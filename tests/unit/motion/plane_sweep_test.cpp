// SPDX-License-Identifier: GPL-3.0-or-later
#include "plane_sweep.h"

#include <gtest/gtest.h>

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "unit/motion/bumpy_scene.h"

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

TEST(PlaneSweep, FindsABumpySurface) {
  const Clip clip{BumpyScene{}};
  const SweptDepth swept = sweep_depth(clip.reference(), clip.others(), kRange, {});
  // A pixel of parallax is 4 mm of depth at these baselines; a twentieth is what NCC tells.
  EXPECT_LT(median_error(swept.depth, clip.truth()), 0.003);
  EXPECT_GT(known_share(swept.depth), 0.95);
}

TEST(PlaneSweep, FollowsTheCoarserLevelsSurface) {
  const Clip clip{BumpyScene{}, 320};
  SweepOptions options;
  options.coarsest_px = 100;
  const SweptDepth swept = sweep_depth(clip.reference(), clip.others(), kRange, options);
  EXPECT_LT(median_error(swept.depth, clip.truth()), 0.002);
  EXPECT_GT(known_share(swept.depth), 0.95);
}

TEST(PlaneSweep, KnowsWhatItDoesNotKnow) {
  Clip clip{BumpyScene{.texture = 0}};
  // Without texture only shading is left, which moves with the lamp: what is said must be doubted.
  const SweptDepth bare = sweep_depth(clip.reference(), clip.others(), kRange, {});
  double doubt = 0;
  for (std::size_t k = 0; k < bare.depth.size(); ++k) doubt += bare.confidence.values[k];
  const Clip textured{BumpyScene{}};
  const SweptDepth good = sweep_depth(textured.reference(), textured.others(), kRange, {});
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
  const SweptDepth swept = sweep_depth(clip.reference(), clip.others(), kRange, {});
  for (int y = 50; y < 70; ++y)
    for (int x = 70; x < 100; ++x) ASSERT_FALSE(std::isfinite(swept.depth.at(x, y)));
  EXPECT_LT(median_error(swept.depth, clip.truth()), 0.003);
}

TEST(PlaneSweep, IsTheSameForAnyNumberOfThreads) {
  const Clip clip{BumpyScene{}};
  const auto run = [&](int threads) {
    const ThreadLimit limit(threads);
    return sweep_depth(clip.reference(), clip.others(), kRange, {});
  };
  const SweptDepth one = run(1), four = run(4);
  EXPECT_EQ(one.depth, four.depth);
  EXPECT_EQ(one.relative_sd, four.relative_sd);
  EXPECT_EQ(one.confidence, four.confidence);
}

TEST(PlaneSweep, RefusesWhatItCannotMatch) {
  const Clip clip{BumpyScene{}};
  EXPECT_THROW(sweep_depth(clip.reference(), {}, kRange, {}), BadDataError);
  EXPECT_THROW(sweep_depth(clip.reference(), clip.others(), {80, 45}, {}), UsageError);
  PosedFrame other = clip.frames[0];
  other.counts = Mask(3, 3, 1);
  EXPECT_THROW(sweep_depth(clip.reference(), {&other}, kRange, {}), BadDataError);
  other = clip.frames[0];
  other.camera.intrinsics.k1 = 0.1;
  EXPECT_THROW(sweep_depth(clip.reference(), {&other}, kRange, {}), BadDataError);
}

TEST(PlaneSweep, OptionsCheckThemselves) {
  EXPECT_NO_THROW(SweepOptions{}.check());
  EXPECT_THROW(SweepOptions{.label_px = 0}.check(), UsageError);
  EXPECT_THROW(SweepOptions{.most_labels = 4}.check(), UsageError);
  EXPECT_THROW(SweepOptions{.refining_labels = 3}.check(), UsageError);
  EXPECT_THROW(SweepOptions{.window_radius_px = 0}.check(), UsageError);
  EXPECT_THROW(SweepOptions{.best = 9}.check(), UsageError);
  EXPECT_THROW(SweepOptions{.smooth_jump = 0}.check(), UsageError);
  EXPECT_THROW(SweepOptions{.least_correlation = 0.9}.check(), UsageError);
}

}  // namespace
}  // namespace organbake
