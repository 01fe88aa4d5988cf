// SPDX-License-Identifier: GPL-3.0-or-later
// Depths and poses of unlike units: the organ must come out where and as large as it is.
#include "organbake/fusion/fuse_views.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "organ_views.h"
#include "organbake/core/error.h"
#include "support/error_message.h"

namespace organbake {
namespace {

using testing::HasSubstr;

constexpr double kScale = 0.005;    // of the scale that is found
constexpr double kWorseEach = 1.5;  // a map's own scale is told by what it shares alone
constexpr double kWorse = 1.2;      // than with poses and depths in one unit
constexpr double kUnit_mm = 7.3;    // of poses as COLMAP has them

OrganViews organ() { return organ_views(10, 192, {.noise = 0.01}); }

double error_mm(const FusedSurface& fused, const OrganViews& organ) {
  return errors_of(fused.mesh, organ.truth).rms_mm;
}

double usual_error_mm() {
  static const double usual = [] {
    const OrganViews organ_mm = organ();
    return error_mm(fuse_views(organ_mm.views, {.scale = DepthScale::given}), organ_mm);
  }();
  return usual;
}

void scale_places(double factor, OrganViews& organ) {
  for (DepthView& view : organ.views) view.camera.camera_from_world.translation *= factor;
}

void make_relative(double factor, DepthView& view) {
  for (float& z : view.depth_mm.values) z *= static_cast<float>(factor);
  view.relative = true;
}

TEST(SolveScale, PosesAndDepthsOfOneUnitStayAsTheyAre) {
  const OrganViews organ_mm = organ();
  const FusedSurface fused = fuse_views(organ_mm.views, {});
  EXPECT_FALSE(fused.scale);
  EXPECT_LT(error_mm(fused, organ_mm), kWorse * usual_error_mm());
}

TEST(SolveScale, MetricDepthsBringTheirUnitToThePoses) {
  for (const double unit_mm : {kUnit_mm, 1 / kUnit_mm}) {
    OrganViews organ_mm = organ();
    scale_places(1 / unit_mm, organ_mm);
    const FusedSurface fused = fuse_views(organ_mm.views, {});
    ASSERT_TRUE(fused.scale) << unit_mm;
    EXPECT_NEAR(fused.scale->solved.place_factor / unit_mm, 1, kScale);
    EXPECT_LT(error_mm(fused, organ_mm), kWorse * usual_error_mm());
  }
}

TEST(SolveScale, RelativeDepthsTakeTheUnitOfThePoses) {
  OrganViews organ_mm = organ();
  for (DepthView& view : organ_mm.views) make_relative(1 / 80.0, view);
  const FusedSurface fused = fuse_views(organ_mm.views, {});
  ASSERT_TRUE(fused.scale);
  EXPECT_EQ(fused.scale->how, DepthScale::one);
  EXPECT_TRUE(fused.scale->in_poses_unit);
  EXPECT_LT(error_mm(fused, organ_mm), kWorse * usual_error_mm());
}

// As `shade` writes them without a range: every map's median is 1.
TEST(SolveScale, EachMapMayHaveAUnitOfItsOwn) {
  OrganViews organ_mm = organ();
  for (std::size_t i = 0; i < organ_mm.views.size(); ++i)
    make_relative((i % 3 + 1) / 120.0, organ_mm.views[i]);
  const FusedSurface fused = fuse_views(organ_mm.views, {});
  ASSERT_TRUE(fused.scale);
  EXPECT_EQ(fused.scale->how, DepthScale::each);
  EXPECT_NEAR(fused.scale->solved.depth_factor[0] / fused.scale->solved.depth_factor[2], 3,
              3 * kScale);
  EXPECT_LT(error_mm(fused, organ_mm), kWorseEach * usual_error_mm());
}

TEST(SolveScale, UnitsThatCannotBeMeantAreRefused) {
  OrganViews organ_mm = organ();
  make_relative(0.001, organ_mm.views[1]);
  const auto refusal = [&](DepthScale scale) {
    return message_of(ExitCode::bad_data, [&] { fuse_views(organ_mm.views, {.scale = scale}); });
  };
  EXPECT_THAT(refusal(DepthScale::automatic), HasSubstr("view 1: is relative, others"));
  for (DepthView& view : organ_mm.views) view.relative = true;
  EXPECT_THAT(refusal(DepthScale::given), HasSubstr("another unit"));
}

std::vector<SmoothView> smooth(const OrganViews& organ) {
  std::vector<SmoothView> views;
  for (const DepthView& view : organ.views) views.push_back(smooth_view(view));
  return views;
}

TEST(RefinePoses, ViewsThatAreOffComeTogether) {
  std::vector<SmoothView> views = smooth(organ_views(8, 192, {.place_mm = 1, .angle_rad = 0.017}));
  const RefinedPoses refined = refine_poses({}, views);
  // What remains is the depth maps' own coarseness, not the poses.
  constexpr double kTogether = 0.15;
  EXPECT_LT(refined.after_mm, kTogether * refined.before_mm);
  EXPECT_GT(refined.moved_mm, 0.3);
}

TEST(RefinePoses, ExactViewsStayWhereTheyAre) {
  std::vector<SmoothView> views = smooth(organ_views(8, 192, {}));
  const RefinedPoses refined = refine_poses({}, views);
  constexpr double kStill_mm = 0.1, kStill_rad = 0.001;
  EXPECT_LT(refined.moved_mm, kStill_mm);
  EXPECT_LT(refined.turned_rad, kStill_rad);
}

TEST(RefinePoses, OneViewHasNothingToGoBy) {
  std::vector<SmoothView> views = smooth(organ_views(1, 64, {}));
  EXPECT_EQ(refine_poses({}, views).rounds, 0);
}

}  // namespace
}  // namespace organbake
