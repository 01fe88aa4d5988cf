// SPDX-License-Identifier: Apache-2.0
#include "organbake/evaluation/comparison_table.h"

#include "organbake/bundle/bundle.h"
#include "organbake/image/difference.h"
#include "organbake/player/orbit.h"
#include "organbake/warp/warper.h"
#include "support/organs.h"
#include "support/testing.h"

namespace organbake {
namespace {

// Maps of 128² on a picture of 256²: bilinear lookup between texels of about 1.2 mm on a surface
// with lumps stays within a small part of a pixel, while 80 flat faces are off by whole ones.
constexpr double kImageBasedPx = 0.2;
constexpr double kPolygonsPx = 0.8;
// Where a camera grazes the skin a texel's worth of depth, 1.2 mm, is in doubt: 2 pixels from the
// side. A vertex taken for the surface before it, from over the horizon, would be off by more.
constexpr double kGrazingPx = 2;

class ProjectionErrorTest : public testing::Test {
 protected:
  CarriedSurface truth_{organ_options().organ.mesh(5), organ_to_play().shell()};
  ProjectionComparison comparison_{organ_to_play(), truth_};
};

TEST_F(ProjectionErrorTest, ImageBasedBeatsPolygonsAllRound) {
  for (const double angle : {0.0, 0.7, 1.9, 2.45}) {
    const View view = orbit_view(organ_to_play().cameras, {angle}, 256, 256);
    const ProjectionErrors e = comparison_.measure(organ_to_play().proxy.vertices, view);
    EXPECT_GT(e.visible, truth_.at_rest().vertices.size() / 4);
    EXPECT_GT(e.image_based.vertices, 8 * e.visible / 10);  // the rest lies at silhouettes
    EXPECT_EQ(e.without_map + e.image_based.vertices, e.visible);
    EXPECT_LT(e.image_based.mean_px, kImageBasedPx) << angle;
    EXPECT_LT(e.image_based.max_px, kGrazingPx) << angle;
    EXPECT_GT(e.polygons.mean_px, kPolygonsPx) << angle;
  }
}

TEST_F(ProjectionErrorTest, StaysSmallUnderADent) {
  const Bundle& organ = organ_to_play();
  const auto positions = dented(organ.proxy, organ.cameras.manifold.directions[0], 15);
  const View view = orbit_view(organ.cameras, {0.7}, 256, 256);
  EXPECT_LT(comparison_.measure(positions, view).image_based.mean_px, kImageBasedPx);
}

TEST_F(ProjectionErrorTest, NoticesAWrongDepth) {
  Bundle wrong = organ_to_play();
  for (CameraMaps& maps : wrong.maps) {
    for (float& depth : maps.depth_mm) depth += 1.0f;  // a millimetre along every ray
  }
  const ProjectionComparison comparison(wrong, truth_);
  const View view = orbit_view(wrong.cameras, {0.7}, 256, 256);
  const double right = comparison_.measure(wrong.proxy.vertices, view).image_based.mean_px;
  EXPECT_GT(comparison.measure(wrong.proxy.vertices, view).image_based.mean_px, right + 0.2);
}

DrawOptions telling() {
  DrawOptions options;
  options.keep_bound = true;
  return options;
}
Frame drawn_and_told(const std::vector<Eigen::Vector3d>& positions, const View& view) {
  Frame frame;
  Warper(organ_to_play()).draw(positions, view, telling(), frame);
  return frame;
}

TEST_F(ProjectionErrorTest, PixelsShowTheSkinThatBelongsThere) {
  const Bundle& organ = organ_to_play();
  const auto& rest = organ.proxy.vertices;
  const View view = orbit_view(organ.cameras, {0.7}, 128, 128);
  for (const auto& positions :
       {rest, dented(organ.proxy, organ.cameras.manifold.directions[0], 15)}) {
    const auto shown = comparison_.displayed(drawn_and_told(positions, view), positions, view);
    EXPECT_GT(shown.vertices, 3000u) << "pixels";
    EXPECT_LT(shown.mean_px, 0.1) << "the colour is that of the very point";
  }
}

TEST_F(ProjectionErrorTest, NoticesAFrameOfAnotherView) {
  const Bundle& organ = organ_to_play();
  const View view = orbit_view(organ.cameras, {0.7}, 128, 128);
  const View beside = orbit_view(organ.cameras, {0.75}, 128, 128);
  const Frame frame = drawn_and_told(organ.proxy.vertices, view);
  EXPECT_GT(comparison_.displayed(frame, organ.proxy.vertices, beside).mean_px, 1);
}

// Within the outline: at it a ray a pixel is as good or bad as a splat. The warp sharpens colours
// between texels, where the ideal reads them in proportion: that may bring it a little beyond.
TEST(IdealPicture, IsAsNearToTheTruthAsWhatTheWarpMakesOfTheMaps) {
  constexpr double kSharper_db = 0.25;
  const Bundle& organ = organ_to_play();
  const CarriedSurface truth(organ_options().organ.mesh(7), organ.shell());
  const auto positions = dented(organ.proxy, organ.cameras.manifold.directions[0], 10);
  const View view = orbit_view(organ.cameras, {0.7}, 128, 128);
  const TruthFrame expected = truth.draw(truth.carry(positions), view, {0, 0, 0});
  std::vector<std::uint8_t> inside = expected.covered;
  for (std::uint8_t& rays : inside) rays = rays == TruthFrame::kRaysPerPixel;
  const auto error_db = [&](const Rgb8Image& picture) {
    return compare_images(picture, expected.color, inside).psnr_db;
  };
  const double ideal_db = error_db(ideal_picture(organ, truth, positions, view, {0, 0, 0}));
  DrawOptions options;
  options.background = {0, 0, 0};
  Frame frame;
  Warper(organ).draw(positions, view, options, frame);
  EXPECT_GT(ideal_db, error_db(frame.color) - kSharper_db);
  EXPECT_GT(ideal_db, 30);
}

constexpr int kSize = 64;

// Two faces side by side, everything covered, one grey.
TruthFrame two_faces() {
  TruthFrame truth;
  truth.color = Rgb8Image(kSize, kSize);
  std::fill(truth.color.pixels.begin(), truth.color.pixels.end(), std::uint8_t{100});
  truth.sharp = truth.color;
  truth.covered.assign(kSize * kSize, TruthFrame::kRaysPerPixel);
  for (int i = 0; i < kSize * kSize; ++i) truth.shell_face.push_back(i % kSize < kSize / 2 ? 3 : 7);
  return truth;
}

void brighten(Rgb8Image& image, int x0, int x1, int by) {
  for (int y = 0; y < kSize; ++y) {
    for (int x = x0; x < x1; ++x)
      image.at(x, y)[1] = static_cast<std::uint8_t>(image.at(x, y)[1] + by);
  }
}

TEST(EdgeSteps, FindASeamOfFive) {
  const TruthFrame truth = two_faces();
  Rgb8Image frame = truth.color;
  brighten(frame, kSize / 2, kSize, 5);
  const SeamSteps steps = edge_steps(frame, truth);
  EXPECT_EQ(steps.places, 1u);
  EXPECT_NEAR(steps.frame, 5, 1e-9);
  EXPECT_NEAR(steps.truth, 0, 1e-9);
  EXPECT_NEAR(steps.excess, 5, 1e-9);
}

TEST(EdgeSteps, DoNotBlameAStepThatTheTruthHas) {
  TruthFrame truth = two_faces();
  brighten(truth.sharp, kSize / 2, kSize, 30);
  EXPECT_NEAR(edge_steps(truth.sharp, truth).excess, 0, 1e-9);
}

TEST(EdgeSteps, LookAtFullyCoveredPixelsOnly) {
  TruthFrame truth = two_faces();
  for (int y = 0; y < kSize; ++y) truth.covered[y * kSize + kSize / 2] = 7;  // a silhouette there
  EXPECT_EQ(edge_steps(truth.color, truth).places, 0u);
}

TEST(SwitchSteps, FindAPatchThatJumps) {
  const TruthFrame truth = two_faces();
  Rgb8Image after = truth.color;
  brighten(after, 16, 32, 9);
  const SeamSteps steps = switch_steps(truth.color, after, truth, truth);
  EXPECT_EQ(steps.places, 64u);
  EXPECT_NEAR(steps.excess, 9, 1e-9);
}

}  // namespace
}  // namespace organbake
