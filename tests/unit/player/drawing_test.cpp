// SPDX-License-Identifier: Apache-2.0
// Pictures of a player: by another way of drawing in the processor's place, of several organs, in
// false colours.

#include "organbake/core/error.h"
#include "organbake/image/difference.h"
#include "organbake/player/false_colors.h"
#include "organbake/player/orbit.h"
#include "organbake/player/player.h"
#include "organbake/warp/paper_warp.h"
#include "organs_to_play.h"

#ifdef ORGANBAKE_GRAPHICS
#include "organbake/graphics/graphics_drawing.h"
#include "support/testing.h"
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
  Bundle alive = organ_to_cut();  // it bleeds
  alive.lighting.emplace();
  alive.lighting->ambient_above.setConstant(0.6), alive.lighting->ambient_below.setConstant(0.6);
  alive.lighting->finish.grain.setConstant(0.03);
  Player player(alive, with_fem());
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

using Eigen::Vector3d;

// The organ somewhere else in the world, with its cameras.
Bundle organ_at(const Vector3d& offset_mm) {
  Bundle bundle = organ_to_play();
  for (Vector3d& v : bundle.proxy.vertices) v += offset_mm;
  for (auto& camera : bundle.cameras.cameras) {
    RigidTransform& pose = camera.camera_from_world;
    pose.translation -= pose.rotation * offset_mm;
  }
  bundle.cameras.manifold.center_world_mm += offset_mm;
  return bundle;
}

// One before the other for the eye at camera 0, and beside it.
Vector3d behind_and_beside() {
  const RigidTransform world_from_camera =
      organ_to_play().cameras.cameras[0].camera_from_world.inverse();
  return world_from_camera.rotation * Vector3d(40, 0, 60);
}

View view_of(const Player& player) { return orbit_view(player.bundle().cameras, {}, 160, 120); }

DrawOptions with_depth() {
  DrawOptions options;
  options.keep_depth = true;
  return options;
}

// One sample a pixel.
Frame drawn(Player& player, const View& view) {
  DrawOptions options = with_depth();
  options.smooth_outline = false;
  Frame frame;
  player.draw(view, options, frame);
  return frame;
}

TEST(SeveralOrgans, TheNearerOneHidesTheOther) {
  Player both({organ_to_play(), organ_at(behind_and_beside())});
  Player first(organ_to_play()), second(organ_at(behind_and_beside()));
  const View view = view_of(both);
  const Frame joined = drawn(both, view), a = drawn(first, view), b = drawn(second, view);
  std::size_t of_first = 0, of_second = 0, hidden = 0;
  for (std::size_t i = 0; i < joined.depth_mm.size(); ++i) {
    const bool from_a = !(b.depth_mm[i] < a.depth_mm[i]);
    const Frame& nearer = from_a ? a : b;
    EXPECT_EQ(joined.depth_mm[i], nearer.depth_mm[i]);
    EXPECT_EQ(joined.cover[i], nearer.cover[i]);
    for (std::size_t k = 3 * i; k < 3 * i + 3; ++k)
      EXPECT_EQ(joined.color.pixels[k], nearer.color.pixels[k]);
    of_first += from_a && std::isfinite(a.depth_mm[i]);
    of_second += !from_a;
    hidden += from_a && std::isfinite(b.depth_mm[i]);
  }
  EXPECT_GT(of_first, 100u);
  EXPECT_GT(of_second, 100u);
  EXPECT_GT(hidden, 100u);
}

// Against the background, and where one hides the other: by the share of a pixel that is in front.
TEST(SeveralOrgans, AreSmoothedAgainstBackgroundAndEachOther) {
  Player both({organ_to_play(), organ_at(behind_and_beside())});
  const View view = view_of(both);
  const Frame sharp = drawn(both, view);
  Frame smooth;
  both.draw(view, with_depth(), smooth);
  EXPECT_EQ(smooth.cover, sharp.cover);
  const int width = sharp.color.width;
  constexpr float kApart_mm = 20;  // of the two
  int at_background = 0, at_other = 0;
  for (int y = 1; y + 1 < sharp.color.height; ++y) {
    for (int x = 1; x + 1 < width; ++x) {
      if (std::equal(sharp.color.at(x, y), sharp.color.at(x, y) + 3, smooth.color.at(x, y)))
        continue;
      const auto depth = [&](int dx, int dy) {
        return sharp.depth_mm[std::size_t(y + dy) * width + x + dx];
      };
      bool background = std::isinf(depth(0, 0)), other = false;
      for (const float beside : {depth(-1, 0), depth(1, 0), depth(0, -1), depth(0, 1)}) {
        background |= std::isinf(beside);
        other |= std::isfinite(beside) && std::abs(beside - depth(0, 0)) > kApart_mm;
      }
      at_background += background;
      at_other += other && !background;
    }
  }
  EXPECT_GT(at_background, 100);
  EXPECT_GT(at_other, 10);
}

TEST(SeveralOrgans, AnUnchangedFrameIsLeftAloneAndAChangedOneIsNot) {
  Player both({organ_to_play(), organ_at(behind_and_beside())});
  const View view = view_of(both);
  Frame frame;
  EXPECT_FALSE(both.draw(view, {}, frame).unchanged);
  EXPECT_TRUE(frame.depth_mm.empty());
  EXPECT_TRUE(both.draw(view, {}, frame).unchanged);
  EXPECT_FALSE(both.draw(view, with_depth(), frame).unchanged);  // lacked its depth
  EXPECT_FALSE(frame.depth_mm.empty());
  Frame other;
  EXPECT_FALSE(both.draw(view, with_depth(), other).unchanged);  // holds nothing yet
  EXPECT_EQ(other.color.pixels, frame.color.pixels);
}

// A tool presses the first from the other side until it leans on the second.
TEST(SeveralOrgans, APokeReachesTheNeighbour) {
  const Bounds box = bounds(organ_to_play().proxy);
  const Vector3d beside((box.max - box.min).x() + 1, 0, 0);
  Player both({organ_to_play(), organ_at(beside)});
  const std::vector<Vector3d> rest = both.proxy_positions(1);
  StepReport report;
  for (int step = 0; step <= 80; ++step) {
    const Vector3d at(box.min.x() - 6 + 0.5 * step, box.center().y(), box.center().z());
    report = both.step({{at, 6, Ball{}, true, Vector3d::Zero()}});
  }
  EXPECT_GT(report.tissue_contacts, 0u);
  EXPECT_NE(both.proxy_positions(1), rest);
  both.reset();
  EXPECT_EQ(both.proxy_positions(1), rest);
}

TEST(SeveralOrgans, ThePapersWarpIsForOne) {
  Player both({organ_to_play(), organ_at(behind_and_beside())}, {}, true);
  both.draw_by(std::make_shared<PaperWarp>(both.bundle()));
  Frame frame;
  EXPECT_THROW(both.draw(view_of(both), {}, frame), UsageError);
  EXPECT_THROW(Player(std::vector<Bundle>{}), UsageError);
}

// A square of two faces across the z axis, which turns to an eye before it.
MeasuredSurface square() {
  MeasuredSurface surface;
  surface.posed.vertices = {{-10, -10, 0}, {10, -10, 0}, {10, 10, 0}, {-10, 10, 0}};
  surface.posed.faces = {{0, 2, 1}, {0, 3, 2}};
  surface.values = {0, 1, 1, 0};
  return surface;
}

TEST(FalseColors, StrainIsThePrincipalStretchWhicheverWayItPoints) {
  const TriangleMesh mesh = square().posed;
  const auto strained = [&](const Eigen::Matrix3d& by) {
    std::vector<Vector3d> posed;
    for (const Vector3d& v : mesh.vertices) posed.push_back(by * v + Vector3d(1, 2, 3));
    return surface_strain(mesh.faces, mesh.vertices, posed)[0];
  };
  const Eigen::Matrix3d turned =
      Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  const Eigen::Matrix3d aslant = Eigen::AngleAxisd(0.4, Vector3d::UnitZ()).toRotationMatrix();
  EXPECT_NEAR(strained(turned), 0, 1e-9);
  for (const double stretch : {1.25, 0.7}) {
    const Eigen::Matrix3d along = Vector3d(stretch, 1, 1).asDiagonal();
    EXPECT_NEAR(strained(turned * aslant * along * aslant.transpose()), stretch - 1, 1e-9);
  }
}

TEST(FalseColors, DisplacementIsALength) {
  EXPECT_EQ(displacement_mm({{0, 0, 0}, {1, 1, 1}}, {{3, 4, 0}, {1, 1, 1}}),
            (std::vector<double>{5, 0}));
}

TEST(FalseColors, GoFromDarkToBrightAndStayWithinTheirEnds) {
  int before = -1;
  for (int i = 0; i <= 32; ++i) {
    const auto [r, g, b] = false_color(i / 32.0);
    const int grey = 30 * r + 59 * g + 11 * b;
    EXPECT_GT(grey, before);
    before = grey;
  }
  EXPECT_EQ(false_color(-3), false_color(0));
  EXPECT_EQ(false_color(7), false_color(1));
}

TEST(FalseColors, PaintTheSkinAloneByItsNumbers) {
  View view;
  view.camera.intrinsics = {80, 60, 100, 100, 40, 30};
  view.camera.camera_from_world.translation = Vector3d(0, 0, 100);
  Frame frame;
  frame.color = Rgb8Image(80, 60);
  std::fill(frame.color.pixels.begin(), frame.color.pixels.end(), std::uint8_t{110});
  frame.cover.assign(80 * 60, Cover::samples);
  frame.cover[30 * 80 + 41] = Cover::solid;
  const Rgb8Image painted = false_color_picture(frame, view, {square()}, 0, 1);
  const auto pixel = [&](int x, int y) {
    const std::uint8_t* p = painted.at(x, y);
    return std::array<std::uint8_t, 3>{p[0], p[1], p[2]};
  };
  const std::array<std::uint8_t, 3> plain = {110, 110, 110};
  EXPECT_EQ(pixel(2, 2), plain);    // beside the square
  EXPECT_EQ(pixel(41, 30), plain);  // a tool
  for (const int x : {32, 39, 47}) {
    const auto expected = false_color((x + 0.5 - 30) / 20);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(pixel(x, 30)[c], expected[c], 2);
  }
}

}  // namespace
}  // namespace organbake
