// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/truth/lens_picture.h"

#include "organbake/core/error.h"
#include "organbake/image/srgb.h"
#include "organbake/player/orbit.h"
#include "support/error_message.h"
#include "support/testing.h"
#include "traced_organ.h"

namespace organbake {
namespace {

constexpr int kLensSide_px = 320;
// As without a lens, but for what is hidden: it ends at outlines, which a picture twice as fine
// tells to a tenth of a pixel, of an organ 200 pixels across.
constexpr double kLensDepthRms_mm = 0.05, kLensNormals_deg = 2, kLensFlow_px = 0.1,
                 kLensPoint_px = 0.1;
constexpr double kLensMaskIou = 0.998, kLensHiddenIou = 0.945;

// Strong barrel distortion, a little off its middle.
ScopeLens scope() {
  ScopeLens lens;
  lens.intrinsics =
      orbit_view(traced_organ().cameras, {}, kLensSide_px, kLensSide_px).camera.intrinsics;
  Intrinsics& k = lens.intrinsics;
  k.cx += 4, k.cy -= 3;
  const double r2 = std::pow(kLensSide_px / 2.0 / k.fx, 2);  // at the middle of a side
  k.k1 = -0.18 / r2, k.k2 = 0.02 / (r2 * r2), k.p1 = 0.01, k.p2 = -0.02;
  return lens;
}

class LensPictureTest : public testing::Test {
 protected:
  View pinhole(double azimuth) const {
    View view = orbit_view(traced_organ().cameras, {azimuth, 0.1}, kLensSide_px, kLensSide_px);
    view.camera.intrinsics = lens_.pinhole();
    return view;
  }
  View through(double azimuth) const {
    View view = pinhole(azimuth);
    view.camera.intrinsics = lens_.lens();
    return view;
  }
  Eigen::Vector2d center(std::size_t i) const {
    return {double(i % kLensSide_px) + 0.5, double(i / kLensSide_px) + 0.5};
  }

  LensPicture lens_{scope(), "scope.json"};
  Player player_{traced_organ()};
  TruthTracker tracker_{layers_from("all")};
};

TEST_F(LensPictureTest, LayersAreWhatTheScopesRaysMeet) {
  poke(player_, 8);
  draw_with_truth(player_, pinhole(0.2), {}, tracker_);
  PixelTruth seen;
  lens_.show(tracker_.now(), seen);
  const auto carried = traced_surface().carry(player_.proxy_positions());
  const Traced truth = traced(carried, through(0.2));
  const auto shells = traced_organ().shell().posed_matrices(player_.proxy_positions());
  double depth2 = 0, degrees = 0, points_px = 0;
  std::size_t count = 0;
  std::vector<bool> skin(seen.pixels()), traced_skin(seen.pixels());
  for (std::size_t i = 0; i < seen.pixels(); ++i) {
    skin[i] = seen.label[i] != 0, traced_skin[i] = truth.covered(i);
    if (!skin[i] || !truth.covered(i) || truth.outline[i]) continue;
    ++count;
    depth2 += std::pow(double(seen.depth_mm[i]) - truth.depth_mm[i], 2);
    degrees += 57.29578 *
               std::acos(std::clamp(seen.normal[i].cast<double>().dot(truth.normal[i]), -1., 1.));
    const BoundPixel& b = seen.bound[i];
    const Eigen::Vector3d p = shell_point(shells[b.face], b.b1, b.b2, b.height_mm);
    points_px += (project(through(0.2).camera, p) - center(i)).norm();
  }
  ASSERT_GT(count, 20000u);
  const double n = double(count), rms = std::sqrt(depth2 / n),
               iou = intersection_over_union(skin, traced_skin);
  RecordProperty("figures", "depth " + std::to_string(rms) + " mm, normals " +
                                std::to_string(degrees / n) + " degrees, points " +
                                std::to_string(points_px / n) + " px, mask " + std::to_string(iou));
  EXPECT_LE(rms, kLensDepthRms_mm);
  EXPECT_LE(degrees / n, kLensNormals_deg);
  EXPECT_LE(points_px / n, kLensPoint_px);
  EXPECT_GE(iou, kLensMaskIou);
}

TEST_F(LensPictureTest, FlowIsInPixelsOfTheScope) {
  std::vector<Eigen::Vector3d> carried[2];
  Traced truth[2];
  const double azimuths[] = {0.0, 0.5};
  for (int i = 0; i < 2; ++i) {
    if (i == 1) poke(player_, 12);
    draw_with_truth(player_, pinhole(azimuths[i]), {}, tracker_);
    carried[i] = traced_surface().carry(player_.proxy_positions());
    truth[i] = traced(carried[i], through(azimuths[i]));
  }
  Flow drawn, seen;
  tracker_.find_forward(drawn);
  lens_.show(drawn, tracker_.before(), seen);
  const Sight sight(carried[1], through(azimuths[1]));
  double sum = 0;
  std::size_t count = 0;
  std::vector<bool> hidden(seen.px.size()), traced_hidden(seen.px.size());
  for (std::size_t i = 0; i < seen.px.size(); ++i) {
    if (!truth[0].covered(i)) continue;
    const Eigen::Vector3d now = traced_surface().point(truth[0].seen[i], carried[1]);
    hidden[i] = seen.seen[i] == 0, traced_hidden[i] = !sight.sees(now);
    if (truth[0].outline[i] || traced_hidden[i] || hidden[i]) continue;
    sum += (seen.px[i].cast<double>() - (project(through(azimuths[1]).camera, now) - center(i)))
               .norm();
    ++count;
  }
  ASSERT_GT(count, 10000u);
  const double iou = intersection_over_union(hidden, traced_hidden);
  RecordProperty("figures",
                 std::to_string(sum / double(count)) + " px, hidden " + std::to_string(iou));
  EXPECT_LE(sum / double(count), kLensFlow_px);
  EXPECT_GE(iou, kLensHiddenIou);
}

// Of a picture whose colour is where it lies: each ray brings that of its own place.
TEST_F(LensPictureTest, ColorsComeFromWhereTheRaysLead) {
  const Intrinsics& wide = lens_.pinhole();
  Rgb8Image drawn(wide.width, wide.height), seen;
  for (int y = 0; y < wide.height; ++y)
    for (int x = 0; x < wide.width; ++x)
      for (int c = 0; c < 3; ++c)
        drawn.at(x, y)[c] = static_cast<std::uint8_t>(
            40 + 170 * (c == 0 ? double(x) / wide.width : double(y) / wide.height));
  lens_.show(drawn, seen);
  ASSERT_EQ(seen.width, kLensSide_px);
  constexpr double kStep = 1.5;  // of 8 bits
  for (const std::size_t i : {0u, 319u, 51000u, 60123u, 102399u}) {
    const Eigen::Vector2d from = project(wide, unproject(lens_.lens(), center(i)));
    EXPECT_NEAR(seen.pixels[3 * i], 40 + 170 * (from.x() - 0.5) / wide.width, kStep) << i;
    EXPECT_NEAR(seen.pixels[3 * i + 1], 40 + 170 * (from.y() - 0.5) / wide.height, kStep) << i;
  }
}

TEST_F(LensPictureTest, AVignetteTakesLightByTheAngleToTheAxis) {
  ScopeLens lens = scope();
  lens.vignette_exponent = 3;
  const LensPicture dim(lens, "scope.json");
  Rgb8Image drawn(dim.pinhole().width, dim.pinhole().height), seen;
  std::fill(drawn.pixels.begin(), drawn.pixels.end(), std::uint8_t{200});
  dim.show(drawn, seen);
  for (const std::size_t i : {0u, 160u, 51359u, 102399u}) {
    const double cosine = unproject(lens.intrinsics, center(i)).normalized().z();
    const double light = linear_from_srgb8()[200] * std::pow(cosine, 3);
    EXPECT_NEAR(seen.pixels[3 * i], srgb8_from_linear(float(light)), 1) << i;
  }
}

TEST_F(LensPictureTest, RefusesLensesThatFoldOrSeeTooWide) {
  ScopeLens folding = scope();
  folding.intrinsics.k1 *= 6, folding.intrinsics.k2 = 0;
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { LensPicture(folding, "bad.json"); }),
              testing::AllOf(testing::HasSubstr("bad.json"), testing::HasSubstr("folds")));
  ScopeLens wide = scope();
  wide.intrinsics.cx = 1e6;
  EXPECT_THROW(LensPicture(wide, "bad.json"), BadDataError);
}

TEST(ScopeLens, IsReadFromWhatPeopleHave) {
  const ScopeLens lens = scope_lens_from_json(
      R"({"width": 640, "height": 480, "fx": 500, "fy": 510, "cx": 320, "cy": 250,
          "distortion_k1_k2_p1_p2_k3": [-0.3, 0.1, 0.001, -0.002, 0], "vignette_exponent": 2})",
      "l.json");
  EXPECT_EQ(lens.intrinsics.fy, 510);
  EXPECT_EQ(lens.intrinsics.p2, -0.002);
  EXPECT_EQ(lens.vignette_exponent, 2);
  const ScopeLens half = lens.in_size(320, 240);
  EXPECT_EQ(half.intrinsics.fx, 250);
  EXPECT_EQ(half.intrinsics.cy, 125);
  EXPECT_EQ(half.intrinsics.k1, -0.3);
  ScopeLens round = lens;
  round.picture.field = 0.75;
  const ScopeLens square = round.in_size(240, 240);  // of its middle, no narrower than it was
  EXPECT_EQ(square.intrinsics.fx, 250);
  EXPECT_EQ(square.intrinsics.fy, 255);
  EXPECT_EQ(square.intrinsics.cx, 120);
  EXPECT_EQ(square.intrinsics.cy, 125);
  EXPECT_EQ(square.picture.field, 1);
  for (const char* bad :
       {"[]", "{}", R"({"width": 640, "height": 480, "fx": 500, "fy": 510, "cx": 320})",
        R"({"width": 640, "height": 480, "fx": -1, "fy": 510, "cx": 320, "cy": 1})",
        R"({"width": 640, "height": 480, "fx": 5, "fy": 510, "cx": 320, "cy": 1, "k1": 3})",
        R"({"width": 640, "height": 480, "fx": 5, "fy": 5, "cx": 3, "cy": 1,
            "distortion_k1_k2_p1_p2_k3": [1, 2]})"})
    EXPECT_THROW(scope_lens_from_json(bad, "l.json"), BadDataError) << bad;
}

ScopePicture all_of_it() {
  return {.field = 0.8,
          .exposure = 1.2,
          .haze = 0.1,
          .bloom = 0.3,
          .sharpening = 0.8,
          .grain = 3,
          .aperture_mm = 0.4,
          .folds = 0.5,
          .surroundings = true};
}

TEST(ScopePicture, IsReadAsItWasWrittenAndRefusesWhatItDoesNotKnow) {
  const std::string lens =
      R"({"width": 64, "height": 48, "fx": 60, "fy": 60, "cx": 32, "cy": 24, "picture": {)";
  const auto read = [&](const std::string& keys) {
    return scope_lens_from_json(lens + keys + "}}", "scope");
  };
  EXPECT_TRUE(read("").picture == ScopePicture());
  ScopeLens scope = read("");
  scope.picture = all_of_it();
  EXPECT_TRUE(scope_lens_from_json(scope_lens_to_json(scope), "scope").picture == all_of_it());
  EXPECT_THROW(read(R"("boom": 1)"), BadDataError);
  EXPECT_THROW(read(R"("field": 0)"), BadDataError);
  EXPECT_THROW(read(R"("grain": -1)"), BadDataError);
  EXPECT_THROW(read(R"("aperture_mm": 6)"), BadDataError);
  EXPECT_THROW(read(R"("folds": 2)"), BadDataError);
  EXPECT_THROW(read(R"("surroundings": 1)"), BadDataError);
}

// A step of 3 mm along a plane that is seen at a slant: what lies lower darkens beside the step,
// what lies higher does not, nor does the plane elsewhere, nor what is beside nothing.
TEST(FoldShadows, DarkenWhatLiesDeeperThanItsSurroundings) {
  constexpr int kWidth = 128, kHeight = 64, kStep = 64, kNothing = 120;
  Rgb8Image picture(kWidth, kHeight);
  std::fill(picture.pixels.begin(), picture.pixels.end(), std::uint8_t{128});
  std::vector<float> depth_mm;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      depth_mm.push_back(x >= kNothing ? std::numeric_limits<float>::infinity()
                                       : 50 + 0.1f * float(y) + (x < kStep ? 0 : 3.0f));
  darken_folds(0.8, 100, depth_mm, picture);
  const auto at = [&](int x) { return int(picture.at(x, kHeight / 2)[1]); };
  EXPECT_LT(at(kStep + 1), 110);
  EXPECT_EQ(at(kStep - 2), 128);
  EXPECT_EQ(at(kStep / 2), 128);
  EXPECT_NEAR(at(100), 128, 1);
  EXPECT_EQ(at(kNothing + 2), 128);
}

// A picture of no field, and one of 200°, which no plane holds.
TEST(ScopeLens, RefusesFieldsOfNothingAndOfMoreThanAPlaneHolds) {
  const auto with_focal = [](const std::string& focal_px) {
    return scope_lens_from_json(R"({"width": 64, "height": 48, "cx": 32, "cy": 24, "fx": )" +
                                    focal_px + R"(, "fy": )" + focal_px + "}",
                                "field.json");
  };
  EXPECT_THROW(with_focal("0"), BadDataError);
  EXPECT_THROW(with_focal("-5"), BadDataError);
  for (const char* const focal_px : {"0.0001", "1e8"}) {
    EXPECT_THAT(
        message_of(ExitCode::bad_data, [&] { LensPicture(with_focal(focal_px), "field.json"); }),
        testing::HasSubstr("has a field of"));
  }
}

// The wall stands still in the world: the same place of it has the same colour from another side.
TEST(CavityWall, StaysInTheWorldBehindTheOrganAndOutOfTheFrame) {
  Player player(traced_organ());
  DrawOptions options;
  options.background = DrawOptions::kCavity;
  options.keep_depth = true;
  const Bounds organs = rest_bounds(player);
  const auto painted = [&](const View& view, Frame& frame) {
    player.draw(view, options, frame);
    Rgb8Image picture;
    paint_cavity_wall({frame, view, organs}, DrawOptions::kCavity, picture);
    return picture;
  };
  const View view = orbit_view(traced_organ().cameras, {0.3, 0.1}, 320, 240);
  View turned = view;  // about its own axis by half a turn: (x, y) goes to (w − x, h − y)
  turned.camera.camera_from_world.rotation.topRows<2>() *= -1;
  turned.camera.camera_from_world.translation.head<2>() *= -1;
  Frame frame, other;
  const Rgb8Image picture = painted(view, frame), upside_down = painted(turned, other);
  std::size_t wall = 0;
  int darkest = 255, brightest = 0;
  for (int y = 0; y < 240; ++y)
    for (int x = 0; x < 320; ++x) {
      if (frame.covered(x, y)) {
        ASSERT_TRUE(std::equal(frame.color.at(x, y), frame.color.at(x, y) + 3, picture.at(x, y)));
        continue;
      }
      if (!std::equal(DrawOptions::kCavity.begin(), DrawOptions::kCavity.end(),
                      frame.color.at(x, y)) ||
          other.covered(319 - x, 239 - y))
        continue;
      ++wall;
      const int red = picture.at(x, y)[0];
      darkest = std::min(darkest, red), brightest = std::max(brightest, red);
      EXPECT_GE(red, picture.at(x, y)[2]);
      EXPECT_NEAR(red, upside_down.at(319 - x, 239 - y)[0], 12);  // lit from the same place, about
    }
  EXPECT_GT(wall, 10000u);
  EXPECT_GT(brightest, darkest + 10);
}

// A checkerboard whose left half lies in focus and whose right half far behind.
TEST(DepthOfField, BlursWhatLiesOffTheFocusByItsDistance) {
  constexpr int kWide = 120, kHigh = 60;
  Rgb8Image picture(kWide, kHigh);
  std::vector<float> depth_mm(kWide * kHigh);
  for (int y = 0; y < kHigh; ++y)
    for (int x = 0; x < kWide; ++x) {
      std::fill_n(picture.at(x, y), 3, static_cast<std::uint8_t>((x / 3 + y / 3) % 2 ? 200 : 40));
      depth_mm[std::size_t(y) * kWide + x] = x < 75 ? 50 : 200;
    }
  const Rgb8Image sharp = picture;
  blur_out_of_focus(0.4, 900, depth_mm, picture);
  const auto contrast = [](const Rgb8Image& of, int x0) {
    int least = 255, most = 0;
    for (int x = x0; x < x0 + 6; ++x)
      least = std::min<int>(least, of.at(x, 30)[1]), most = std::max<int>(most, of.at(x, 30)[1]);
    return most - least;
  };
  EXPECT_EQ(contrast(picture, 30), contrast(sharp, 30));
  EXPECT_LT(contrast(picture, 100), contrast(sharp, 100) / 3);
  std::fill(depth_mm.begin(), depth_mm.end(), std::numeric_limits<float>::infinity());
  picture = sharp;
  blur_out_of_focus(0.4, 900, depth_mm, picture);
  EXPECT_EQ(picture.pixels, sharp.pixels);
}

// Black beyond the round field, noisy within, a glow round what is blown; the same bytes each time.
TEST(ScopePicture, HasARoundFieldNoiseAndAGlow) {
  Rgb8Image drawn(320, 200);
  std::fill(drawn.pixels.begin(), drawn.pixels.end(), std::uint8_t{90});
  for (int y = 95; y < 105; ++y)
    for (int x = 155; x < 165; ++x) std::fill_n(drawn.at(x, y), 3, std::uint8_t{255});
  Rgb8Image seen = drawn;
  apply_scope_picture(ScopePicture(), seen);
  EXPECT_EQ(seen.pixels, drawn.pixels);
  apply_scope_picture({.bloom = 1}, seen);
  EXPECT_GT(seen.at(153, 100)[2], 95);
  EXPECT_EQ(seen.at(20, 20)[0], 90);
  apply_scope_picture(all_of_it(), seen);
  EXPECT_EQ(seen.at(5, 5)[0], 0);
  EXPECT_NE(seen.at(100, 100)[0], seen.at(101, 100)[0]);
  Rgb8Image again = drawn;
  apply_scope_picture({.bloom = 1}, again);
  apply_scope_picture(all_of_it(), again);
  EXPECT_EQ(again.pixels, seen.pixels);
}

}  // namespace
}  // namespace organbake
