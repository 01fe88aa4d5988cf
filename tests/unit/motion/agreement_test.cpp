// SPDX-License-Identifier: GPL-3.0-or-later
#include "agreement.h"

#include <gtest/gtest.h>

#include "unit/motion/bumpy_scene.h"

namespace organbake {
namespace {

struct Swept {
  std::vector<PosedCamera> cameras;
  std::vector<std::vector<std::size_t>> partners;
  std::vector<SweptDepth> depths;

  Swept() {
    const std::vector<BumpyView> views = bumpy_clip(BumpyScene{}, 4);
    for (const BumpyView& view : views) {
      const int width = view.depth_mm.width, height = view.depth_mm.height;
      cameras.push_back(view.camera);
      depths.push_back({view.depth_mm, Plane(width, height, 0.004F), Plane(width, height, 0.5F)});
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

}  // namespace
}  // namespace organbake
