// SPDX-License-Identifier: Apache-2.0
#include "warp/lit_stretch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

namespace organbake {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kFirstColumn = 640;

// Planes of colour 1 after a stretch of this depth was lit: gain_of and gloss_of tell the light of
// each pixel that is asked for.
template <class GainOf, class GlossOf>
std::vector<float> lit(const std::vector<float>& depth, GainOf&& gain_of, GlossOf&& gloss_of,
                       int* asked = nullptr) {
  const int count = static_cast<int>(depth.size());
  const LitStretch stretch(depth.data(), count, 1);
  SkinPixels skin;
  SkinLight light;
  for (int k = 0; k < stretch.post_count(); ++k) {
    const int i = stretch.post(k);
    for (int c = 0; c < 3; ++c)
      light.gain[c][k] = gain_of(i), light.gloss[c][k] = static_cast<float>(c) * gloss_of(i);
    skin.add(kFirstColumn + i, 0, 0, 0);
  }
  if (asked) *asked = skin.count;
  std::vector<float> red(count, 1), green(count, 1), blue(count, 1), white(count, 2);
  stretch.light(skin, light, kFirstColumn, white.data(), count,
                {red.data(), green.data(), blue.data()});
  for (int i = 0; i < count; ++i) EXPECT_NEAR(green[i] - red[i], blue[i] - green[i], 1e-5);
  return green;
}

TEST(LitStretch, LightThatRisesEvenlyIsMixedExactlyFromThreeOfEight) {
  int asked = 0;
  const auto gain = [](int i) { return 0.5f + 0.25f * static_cast<float>(i); };
  const auto gloss = [](int i) { return static_cast<float>(i); };
  const auto green = lit(std::vector<float>(kStretch, 300), gain, gloss, &asked);
  EXPECT_EQ(asked, kStretch * 3 / LitStretch::kGroup);
  for (int i = 0; i < kStretch; ++i) EXPECT_NEAR(green[i], gain(i) + 2 * gloss(i), 1e-4) << i;
}

TEST(LitStretch, EqualLightIsNotRounded) {
  const auto green = lit(
      std::vector<float>(kStretch, 300), [](int) { return 1 / 3.0f; }, [](int) { return 0.0f; });
  for (const float value : green) EXPECT_EQ(value, 1 / 3.0f);
}

// Where the skin breaks off or falls away, and in a group that the stretch's end cuts, every pixel
// has its own light, however it jumps.
TEST(LitStretch, BrokenSkinIsLitByThePixel) {
  std::vector<float> depth(38, 300);
  depth[3] = 302;         // a step in the first group
  depth[17] = kInfinity;  // a hole in the third
  const auto gain = [](int i) { return static_cast<float>(i % 3); };
  const auto green = lit(depth, gain, [](int) { return 0.0f; });
  for (const int i : {0, 1, 2, 3, 4, 5, 6, 7, 16, 18, 19, 23, 32, 33, 37})
    EXPECT_EQ(green[i], gain(i)) << i;
  EXPECT_EQ(green[17], 1) << "not skin: its colour stays";
  EXPECT_EQ(green[8], gain(8));
  EXPECT_EQ(green[12], gain(12));
  EXPECT_EQ(green[15], gain(15));
}

TEST(LitStretch, PostsThatAreNotLitKeepTheirColour) {
  const std::vector<float> depth(16, 300);
  const LitStretch stretch(depth.data(), 16, 1);
  std::vector<float> plane(16, 0.7f), white(16, 1);
  SkinPixels none;
  SkinLight light;
  stretch.light(none, light, 0, white.data(), 16, {plane.data(), plane.data(), plane.data()});
  EXPECT_EQ(std::count(plane.begin(), plane.end(), 0.7f), 16);
}

TEST(LitStretch, NoSkinAsksForNoLight) {
  EXPECT_EQ(LitStretch(std::vector<float>(40, kInfinity).data(), 40, 1).post_count(), 0);
  EXPECT_EQ(LitStretch(nullptr, 0, 1).post_count(), 0);
}

}  // namespace
}  // namespace organbake
