// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/fusion/refine_poses.h"

#include <gtest/gtest.h>

#include "organ_views.h"

namespace organbake {
namespace {

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
