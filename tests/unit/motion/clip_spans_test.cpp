// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/motion/clip_spans.h"

#include <gtest/gtest.h>

#include "unit/motion/bumpy_scene.h"

namespace organbake {
namespace {

constexpr int kWidth = 320, kStep = 8, kPerSecond = 3;

Rgb8Image red_picture(const BumpyView& view) {
  Rgb8Image picture(view.light.width, view.light.height);
  RandomStream random(11, static_cast<std::uint64_t>(std::stoi(view.camera.name)));
  for (std::size_t k = 0; k < view.light.size(); ++k)
    for (int c = 0; c < 3; ++c) {
      const double of_light[] = {150, 75, 65};
      const double level = of_light[c] * double(view.light.values[k]) + 0.5 * random.normal();
      picture.pixels[3 * k + c] = static_cast<std::uint8_t>(std::clamp(level, 0.0, 255.0));
    }
  return picture;
}

TEST(ClipSpans, TellsAMovingScopeFromAStillOneAndFromNoTissue) {
  SpanFinder finder({.shortest_s = 2, .longest_s = 12});
  const std::vector<BumpyView> moving = bumpy_clip({}, 12, kWidth);
  const Rgb8Image still = red_picture(moving.back());
  std::size_t shown = 0;
  const auto show = [&](const Rgb8Image& picture) {
    finder.add(kStep * shown, double(shown) / kPerSecond, picture);
    ++shown;
  };
  for (const BumpyView& view : moving) show(red_picture(view));
  for (int i = 0; i < 12; ++i) show(Rgb8Image(kWidth, kWidth * 3 / 4));
  for (int i = 0; i < 12; ++i) show(still);
  const std::vector<ClipSpan> spans = finder.take();
  ASSERT_EQ(spans.size(), 3u);
  EXPECT_GT(spans[0].worth, SpanFinder::kShadingAlone) << spans[0].reason;
  EXPECT_EQ(spans[0].first, 0u);
  EXPECT_EQ(spans[0].last, kStep * 11u);
  EXPECT_EQ(spans[1].worth, 0) << spans[1].reason;
  EXPECT_EQ(spans[2].reason, "the scope stands still");
  EXPECT_GT(spans[2].worth, 0);
  EXPECT_LE(spans[2].worth, SpanFinder::kShadingAlone);
}

TEST(ClipSpans, CutsWhatIsLong) {
  SpanFinder finder({.shortest_s = 1, .longest_s = 2});
  std::size_t shown = 0;
  for (const BumpyView& view : bumpy_clip({}, 12, kWidth)) {
    finder.add(shown, double(shown) / kPerSecond, red_picture(view));
    ++shown;
  }
  const std::vector<ClipSpan> spans = finder.take();
  ASSERT_EQ(spans.size(), 2u);
  EXPECT_EQ(spans[0].last + 1, spans[1].first);
  EXPECT_EQ(spans[1].last, 11u);
}

TEST(ClipSpans, HasNoneOfNothing) { EXPECT_TRUE(SpanFinder().take().empty()); }

}  // namespace
}  // namespace organbake
