// SPDX-License-Identifier: Apache-2.0
// Another way of drawing in the processor's place.
#include <gtest/gtest.h>

#include "organ_to_cut.h"
#include "organbake/core/error.h"
#include "organbake/image/difference.h"
#include "organbake/player/orbit.h"
#include "organbake/player/player.h"
#ifdef ORGANBAKE_GRAPHICS
#include "organbake/graphics/offscreen_drawing.h"
#endif

namespace organbake {
namespace {

View front_of_cut(const Player& player) {
  return orbit_view(player.bundle().cameras, OrbitPose(), 480, 360);
}

// Fails at its second picture, as a context does that is lost.
class LostDrawing : public OrganDrawing {
 public:
  int asked = 0;

  std::string refusal(const std::vector<JointDrawing::Organ>&, const View&,
                      const DrawOptions& options) const override {
    return options.keep_bound ? "it does not know" : "";
  }
  DrawReport draw(const std::vector<JointDrawing::Organ>&, const View& view, const DrawOptions&,
                  Frame& frame) override {
    if (++asked > 1) throw GraphicsError("the context is lost");
    frame.serial = 0;
    frame.color = Rgb8Image(view.camera.intrinsics.width, view.camera.intrinsics.height);
    return {};
  }
};

TEST(PlayerDrawing, FallsBackToTheProcessorWithoutLosingAnything) {
  Player player(organ_to_cut(), with_fem()), alone(organ_to_cut(), with_fem());
  const View view = front_of_cut(player);
  const auto lost = std::make_shared<LostDrawing>();
  player.draw_by(lost);
  Frame frame, expected;
  player.draw(view, {}, frame);
  EXPECT_EQ(player.drawing_note(), "");
  DrawOptions bound;
  bound.keep_bound = true;
  player.draw(view, bound, frame);
  EXPECT_EQ(player.drawing_note(), "it does not know");
  EXPECT_EQ(lost->asked, 1);
  for (Player* one : {&player, &alone})
    for (int i = 0; i <= 30; ++i) one->step({blade_at(i / 60.0)});
  player.draw(view, {}, frame);
  alone.draw(view, {}, expected);
  EXPECT_EQ(player.drawing_note(), "the context is lost");
  EXPECT_EQ(frame.color.pixels, expected.color.pixels);
  player.draw(view, {}, frame);
  EXPECT_EQ(lost->asked, 2);  // never again
}

#ifdef ORGANBAKE_GRAPHICS
TEST(PlayerDrawing, GraphicsHardwareDrawsCutsAsTheProcessor) {
  std::shared_ptr<OffscreenDrawing> graphics;
  try {
    graphics = std::make_shared<OffscreenDrawing>();
  } catch (const UsageError& error) {
    GTEST_SKIP() << "no cut was drawn with graphics hardware: " << error.what();
  }
  Player player(organ_to_cut(), with_fem());
  const View view = front_of_cut(player);
  for (const double until : {0.0, 0.5, 1.0}) {
    for (int i = 0; i <= 30; ++i) player.step({blade_at(std::max(0.0, until - 0.5 + i / 60.0))});
    if (until == 1.0) let_part(player);
    Frame by_graphics, by_processor;
    player.draw_by(nullptr);
    player.draw(view, {}, by_processor);
    player.draw_by(graphics);
    player.draw(view, {}, by_graphics);
    EXPECT_EQ(player.drawing_note(), "");
    const double psnr_db = compare_images(by_processor.color, by_graphics.color).psnr_db;
    std::printf("cut to %.1f: %.2f dB\n", until, psnr_db);
    EXPECT_GE(psnr_db, GraphicsDrawing::kLeastAgreement_db) << until;
  }
  EXPECT_TRUE(player.is_cut());
}
#endif

}  // namespace
}  // namespace organbake
