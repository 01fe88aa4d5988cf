// SPDX-License-Identifier: GPL-3.0-or-later

#include "organbake/shading/masks.h"
#include "organbake/core/error.h"
#include "organbake/core/random.h"
#include "organbake/phantom/laparoscopy.h"
#include "organbake/shading/grid_filters.h"
#include "organbake/shading/prepared_frame.h"
#include "support/testing.h"

namespace organbake {
namespace {

// A mask drawn with characters: '#' counts, anything else does not.
Mask drawn(const std::vector<std::string>& rows) {
  Mask mask(static_cast<int>(rows.front().size()), static_cast<int>(rows.size()));
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) mask.at(x, y) = rows[y][x] == '#';
  }
  return mask;
}

TEST(Masks, GrowAndShrinkBySquaresButNotFromTheFramesEdge) {
  const Mask dot = drawn({".....", ".....", "..#..", ".....", "....."});
  EXPECT_EQ(dilated(dot, 1), drawn({".....", ".###.", ".###.", ".###.", "....."}));
  EXPECT_EQ(eroded(dilated(dot, 1), 1), dot);
  const Mask left = drawn({"###..", "###..", "###.."});
  EXPECT_EQ(eroded(left, 1), drawn({"##...", "##...", "##..."}));
  EXPECT_EQ(dilated(dot, 0), dot);
}

TEST(Masks, RegionsAreJoinedBySidesNotByCorners) {
  const Mask mask = drawn({"##...", "##...", "..#..", "..###"});
  EXPECT_EQ(largest_region(drawn({"#..", ".##"})), drawn({"...", ".##"}));
  const Mask first = drawn({"#....", ".....", ".....", "....."});
  EXPECT_EQ(regions_touching(mask, first), drawn({"##...", "##...", ".....", "....."}));
  EXPECT_EQ(largest_region(Mask(4, 3)), Mask(4, 3));
}

TEST(Masks, HolesAreWhatTheEdgeDoesNotReach) {
  EXPECT_EQ(with_holes_closed(drawn({".....", ".###.", ".#.#.", ".###."})),
            drawn({".....", ".###.", ".###.", ".###."}));
  const Mask open = drawn({".#.#.", ".#.#.", ".###."});
  EXPECT_EQ(with_holes_closed(open), open);
}

TEST(BoxMean, CountsInsidePixelsOnly) {
  Plane plane(3, 1);
  plane.values = {1, 100, 3};
  const Plane mean = box_mean(plane, drawn({"#.#"}), 1);
  EXPECT_FLOAT_EQ(mean.at(0, 0), 1);
  EXPECT_FLOAT_EQ(mean.at(1, 0), 2);
  EXPECT_FLOAT_EQ(mean.at(2, 0), 3);
  EXPECT_FLOAT_EQ(box_mean(plane, Mask(3, 1), 1).at(1, 0), 0);
}

Rgb8Image tissue(int width, int height) {
  Rgb8Image image(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      std::uint8_t* p = image.at(x, y);
      p[0] = static_cast<std::uint8_t>(150 + (x * 7 + y * 3) % 11);
      p[1] = 60;
      p[2] = 50;
    }
  return image;
}

void paint(Rgb8Image& image, int left, int top, int right, int bottom, int r, int g, int b) {
  for (int y = top; y < bottom; ++y)
    for (int x = left; x < right; ++x) {
      image.at(x, y)[0] = static_cast<std::uint8_t>(r);
      image.at(x, y)[1] = static_cast<std::uint8_t>(g);
      image.at(x, y)[2] = static_cast<std::uint8_t>(b);
    }
}

std::size_t count(const Mask& mask) {
  std::size_t n = 0;
  for (auto value : mask.values) n += value != 0;
  return n;
}

TEST(FieldOfView, DropsTheBorderAndLettersOnIt) {
  Rgb8Image image(120, 80);
  const Rgb8Image organ = tissue(120, 80);
  for (int y = 0; y < 80; ++y)
    for (int x = 0; x < 120; ++x)
      if (std::hypot(x - 60, y - 40) < 36) std::copy_n(organ.at(x, y), 3, image.at(x, y));
  paint(image, 2, 2, 12, 8, 255, 255, 255);  // a logo
  paint(image, 55, 35, 62, 42, 0, 0, 0);     // a shadow
  const Mask field = field_of_view(image, 2);
  EXPECT_FALSE(field.at(5, 5));
  EXPECT_TRUE(field.at(58, 38)) << "a shadow is tissue";
  EXPECT_FALSE(field.at(60, 5)) << "shrunk by the margin";
  EXPECT_NEAR(static_cast<double>(count(field)), 3.14159 * 34 * 34, 250);
}

TEST(FieldOfView, WithoutABorderEverythingCounts) {
  EXPECT_EQ(count(field_of_view(tissue(40, 30), 3)), 1200u);
  EXPECT_EQ(count(field_of_view(Rgb8Image(40, 30), 3)), 0u);
}

TEST(FieldOfView, DarkTissueCountsUpToAStop) {
  Rgb8Image image = tissue(200, 100);
  for (int y = 0; y < 100; ++y)
    for (int x = 0; x < 200; ++x)
      for (int c = 0; c < 3; ++c)
        image.at(x, y)[c] =
            static_cast<std::uint8_t>(std::lround(image.at(x, y)[c] * std::exp(-x / 55.0)));
  EXPECT_LE(*image.at(150, 50), 10) << "as dark as coding leaves a border";
  EXPECT_TRUE(field_of_view(image, 2).at(150, 50));
  paint(image, 140, 0, 200, 100, 2, 2, 2);
  const Mask field = field_of_view(image, 2);
  EXPECT_TRUE(field.at(130, 50));
  EXPECT_FALSE(field.at(142, 50)) << "beyond a step lies a stop";
}

TEST(Highlights, SpotsAreFoundAndTissueIsLeft) {
  Rgb8Image image = tissue(200, 150);
  paint(image, 50, 40, 56, 46, 255, 250, 248);
  paint(image, 120, 90, 124, 93, 215, 190, 185);  // not saturated
  const Mask found = find_highlights(image, Mask(200, 150, 1));
  EXPECT_TRUE(found.at(52, 42));
  EXPECT_TRUE(found.at(121, 91));
  EXPECT_LT(count(found), 200u);
}

// Every channel as a camera, smoke or an editor changes it; what is black stays.
template <class Change>
Rgb8Image changed(Rgb8Image image, const Change& change) {
  for (std::size_t k = 0; k < image.pixels.size(); k += 3) {
    std::uint8_t* p = &image.pixels[k];
    if (std::max({p[0], p[1], p[2]}) <= 16) continue;
    const double grey = (p[0] + p[1] + p[2]) / 3.0;
    for (int c = 0; c < 3; ++c)
      p[c] = static_cast<std::uint8_t>(std::clamp(change(p[c], grey, c), 0.0, 255.0));
  }
  return image;
}
Rgb8Image paled(const Rgb8Image& image) {
  return changed(image, [](double v, double grey, int) { return 0.5 * (v + grey); });
}
Rgb8Image in_smoke(const Rgb8Image& image) {
  return changed(image, [](double v, double, int) { return 0.7 * v + 0.3 * 205; });
}
Rgb8Image tinted(const Rgb8Image& image) {
  return changed(image, [](double v, double, int c) { return v * (1.1 - 0.1 * c); });
}

TEST(Instruments, StraightGreyStripsFromTheRimOnly) {
  Rgb8Image image = tissue(300, 200);
  paint(image, 200, 80, 300, 110, 120, 122, 125);  // a shaft from the right
  paint(image, 80, 80, 120, 120, 200, 190, 185);   // a blown highlight in the middle
  paint(image, 140, 20, 220, 40, 120, 122, 125);   // a grey strip that comes from nowhere
  for (int y = 120; y < 180; ++y)                  // pale tissue from the left
    paint(image, 0, y, 60 - std::abs(y - 150), y + 1, 170, 110, 100);
  const Mask found = find_instruments(image, Mask(300, 200, 1)).value();
  EXPECT_TRUE(found.at(250, 95));
  EXPECT_TRUE(found.at(298, 95));
  EXPECT_FALSE(found.at(100, 100));
  EXPECT_FALSE(found.at(180, 30));
  EXPECT_FALSE(found.at(30, 150));
  EXPECT_NEAR(static_cast<double>(count(found)), 100 * 30, 450);
}

TEST(Instruments, TissueIsLeftAloneHoweverPale) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const LaparoscopyOptions scene{.seed = seed,
                                   .width = 480,
                                   .height = 360,
                                   .frames = 1,
                                   .texture = 0.3,
                                   .two_tissues = true,
                                   .instrument = false};
    const Rgb8Image frame = LaparoscopyPhantom(scene).frame(0).image;
    for (const Rgb8Image& seen : {frame, paled(frame), in_smoke(frame), tinted(frame)}) {
      const Mask field = field_of_view(seen, 3);
      EXPECT_LE(count(find_instruments(seen, field).value()), 0.02 * count(field)) << seed;
    }
  }
}

TEST(Instruments, APaleStraightGallbladderIsNone) {
  const MovingClip phantom(
      {.view = {.width = 640, .height = 360, .frames = 24, .instrument = false},
       .path = ScopePath::slide});
  for (const int index : {8, 12, 22}) {
    const Rgb8Image frame = phantom.frame(index).image;
    EXPECT_EQ(count(find_instruments(frame, field_of_view(frame, 3)).value()), 0u) << index;
  }
}

Rgb8Image noisy(Rgb8Image image) {
  RandomStream random(5);
  for (std::uint8_t& value : image.pixels)
    value = static_cast<std::uint8_t>(
        std::lround(std::clamp(value + 12 * random.normal(), 0.0, 255.0)));
  return image;
}

TEST(Instruments, AShaftIsFoundHoweverPaleTheTissue) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const LaparoscopyOptions scene{
        .seed = seed, .width = 480, .height = 360, .frames = 1, .texture = 0.3};
    const LaparoscopyFrame truth = LaparoscopyPhantom(scene).frame(0);
    for (const Rgb8Image& seen : {truth.image, paled(truth.image), in_smoke(truth.image),
                                  tinted(truth.image), noisy(truth.image)}) {
      const Mask field = field_of_view(seen, 3), tool = common(truth.instrument, field);
      const Mask found = find_instruments(seen, field).value();
      const double both = count(common(found, tool));
      EXPECT_GE(both / (count(found) + count(tool) - both), 0.88) << seed;
    }
  }
}

TEST(Highlights, NoiseAndPaleTissueAreNone) {
  Rgb8Image image = changed(tissue(300, 200), [](double v, double, int) { return 0.3 * v; });
  RandomStream random(1);
  for (std::uint8_t& value : image.pixels)
    value = static_cast<std::uint8_t>(std::clamp(value + 12 * random.normal(), 0.0, 255.0));
  paint(image, 150, 60, 220, 130, 170, 110, 100);  // fat beside dark tissue
  paint(image, 50, 40, 56, 46, 255, 250, 248);
  const Mask found = find_highlights(image, Mask(300, 200, 1));
  EXPECT_TRUE(found.at(52, 42));
  EXPECT_LT(count(found), 150u);
}

TEST(Deinterlace, CombsAreSeenAndRemoved) {
  Rgb8Image image = tissue(160, 120);
  EXPECT_FALSE(is_combed(image));
  for (int y = 1; y < 120; y += 2) paint(image, 60, y, 110, y + 1, 220, 200, 190);
  EXPECT_TRUE(is_combed(image));
  StoredPicture stored(image);
  deinterlace(stored);
  image = stored.color;
  EXPECT_FALSE(is_combed(image));
  EXPECT_EQ(image.at(80, 51)[1], 60);
}

TEST(Frame, HalvingMovesTheCameraAlong) {
  Intrinsics camera = assumed_camera(81, 60, 1.2);
  camera.k1 = 0.1;
  const PreparedFrame frame = prepare_frame(tissue(81, 60), camera, {.halvings = 1});
  EXPECT_EQ(frame.color.width, 40);
  EXPECT_EQ(frame.camera.width, 40);
  EXPECT_DOUBLE_EQ(frame.camera.fx, camera.fx / 2);
  EXPECT_FALSE(frame.camera.has_distortion());
}

// What a fisheye has seen comes out as the pinhole would have seen it; a mask goes along.
TEST(Frame, AFisheyesMiddleIsStraightened) {
  LaparoscopyOptions scene{
      .width = 320, .height = 240, .noise = 0, .instrument = false, .round_view = false};
  const LaparoscopyPhantom phantom(scene);
  PosedCamera camera = phantom.camera(0);
  Intrinsics& lens = camera.intrinsics;
  lens.model = LensModel::fisheye;
  lens.fx = lens.fy = 150;  // 122° across
  lens.k1 = -0.02, lens.k2 = 0.003;
  const Eigen::Vector3d light = camera.center_world_mm();
  const LaparoscopyFrame seen = phantom.frame_seen_by(camera, light, 1);
  const Eigen::Vector3d ray(0.5, 0.2, 1);
  const auto pixel_of = [&](const Intrinsics& k) { return project(k, ray).cast<int>().eval(); };
  Mask instruments(320, 240);
  for (int dy = -2; dy <= 2; ++dy)
    for (int dx = -2; dx <= 2; ++dx)
      instruments.at(pixel_of(lens).x() + dx, pixel_of(lens).y() + dy) = 1;
  const PreparedFrame frame =
      prepare_frame(seen.image, lens, {.piecewise_albedo = false}, {.instruments = &instruments});
  EXPECT_EQ(frame.instruments.at(pixel_of(frame.camera).x(), pixel_of(frame.camera).y()), 1);
  EXPECT_FALSE(frame.camera.has_distortion());
  camera.intrinsics = frame.camera;
  const Rgb8Image straight = phantom.frame_seen_by(camera, light, 1).image;
  double sum = 0, count = 0;
  for (int y = 0; y < 240; ++y)
    for (int x = 0; x < 320; ++x) {
      if (frame.instruments.at(x, y) || frame.color.at(x, y)[0] == 0) continue;
      sum += std::abs(double(frame.color.at(x, y)[1]) - straight.at(x, y)[1]);
      ++count;
    }
  EXPECT_GT(count, 0.6 * 320 * 240);
  EXPECT_LT(sum / count, 1.5);  // levels; interpolation smooths the fine texture
}

TEST(Frame, RefusesALensThatIsNone) {
  for (const double focal : {0.0, -1.0, 5e-324, 1e300, std::numeric_limits<double>::infinity(),
                             std::numeric_limits<double>::quiet_NaN()}) {
    Intrinsics camera = assumed_camera(81, 60, 1.2);
    camera.fx = focal;
    EXPECT_THROW(prepare_frame(tissue(81, 60), camera, {}), BadDataError) << focal;
  }
}

// A texture without end, of waves of 9 to 40 pixels, where a scope has moved to; with noise.
Rgb8Image moved_texture(int width, int height, double right, double down, std::uint64_t frame) {
  RandomStream random(11, frame);
  Rgb8Image image(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const double u = x + right, v = y + down;
      const double wave = std::sin(0.31 * u + 2 * std::sin(0.08 * v)) +
                          std::sin(0.4 * v + 1.5 * std::sin(0.11 * u)) + std::sin(0.16 * (u - v));
      const double level = 130 + 28 * wave + 1.5 * random.normal();
      std::uint8_t* p = image.at(x, y);
      p[0] = static_cast<std::uint8_t>(std::min(255.0, level + 30));
      p[1] = static_cast<std::uint8_t>(0.5 * level);
      p[2] = static_cast<std::uint8_t>(0.4 * level);
    }
  return image;
}

// What a recorder lays over a frame: its box, and how it looks in a frame.
struct LaidOver {
  std::string name;
  int left, top, right, bottom;
  std::function<void(const LaidOver&, int, Rgb8Image&)> draw;
};

void lay_picture(const LaidOver& box, int moved, Rgb8Image& frame) {
  const Rgb8Image other = moved_texture(box.right - box.left, box.bottom - box.top,
                                        500 - 9.0 * moved, 300 + 4.0 * moved, 99);
  for (int y = 0; y < other.height; ++y)
    for (int x = 0; x < other.width; ++x)  // grey, as ultrasound is
      std::fill_n(frame.at(box.left + x, box.top + y), 3, other.at(x, y)[0]);
}

// A ground with blocks for letters; the last one changes now and then, as a clock's does.
void lay_text(const LaidOver& box, int frame, Rgb8Image& image) {
  paint(image, box.left, box.top, box.right, box.bottom, 200, 200, 180);
  const int size = (box.bottom - box.top) / 3;
  for (int i = 0; (2 * i + 2) * size < box.right - box.left; ++i)
    paint(image, box.left + (2 * i + 1) * size, box.top + size + i % 3,
          box.left + (2 * i + 2) * size - (i == 1 && frame / 8 % 2 ? size / 2 : 0),
          box.top + 2 * size, 20, 20, 30);
}

std::vector<LaidOver> everything_laid_over() {
  const auto still = [](const LaidOver& box, int, Rgb8Image& image) { lay_picture(box, 0, image); };
  return {{"still picture", 60, 100, 140, 150, still},
          {"live picture", 200, 20, 290, 80, lay_picture},
          {"bar along the lower border", 0, 200, 320, 240, lay_text},
          {"logo in a corner", 270, 12, 302, 36, lay_text},
          {"frozen panel along a side", 0, 0, 90, 240, still}};
}

// The whole clip of `frames`, moved so many pixels from one to the next; `laid` may be null.
Mask insets_in(const LaidOver* laid, double step_px, int frames = 12) {
  InsetFinder finder;
  for (int i = 0; i < frames; ++i) {
    Rgb8Image frame =
        moved_texture(320, 240, step_px * i, 0.4 * step_px * i, static_cast<std::uint64_t>(i));
    if (laid) laid->draw(*laid, i, frame);
    finder.add(frame);
  }
  return finder.find();
}

TEST(Insets, AreFoundInAMovingClipStillOrLive) {
  for (const LaidOver& laid : everything_laid_over()) {
    const Mask found = insets_in(&laid, 4);
    ASSERT_EQ(found.width, 320) << laid.name;
    double covered = 0;
    for (int y = laid.top; y < laid.bottom; ++y)
      for (int x = laid.left; x < laid.right; ++x) covered += found.at(x, y) != 0;
    const double area = double(laid.right - laid.left) * (laid.bottom - laid.top);
    EXPECT_GE(covered, 0.98 * area) << laid.name;
    // A pixel round it, which coding would have spread it over.
    EXPECT_LE(static_cast<double>(count(found)) - covered, 0.01 * (320 * 240 - area)) << laid.name;
  }
}

TEST(Insets, OfAClipThatMovesWithoutThemAreNone) {
  for (const double step_px : {1.0, 4.0, 30.0}) EXPECT_EQ(insets_in(nullptr, step_px).size(), 0u);
}

TEST(Insets, AreNotLookedForInWhatStandsStill) {
  EXPECT_EQ(insets_in(nullptr, 0).size(), 0u) << "a scope that stands still shows tissue";
  EXPECT_EQ(insets_in(nullptr, 4, 3).size(), 0u) << "of three frames nothing is known";
}

TEST(Insets, OfALongClipAreFoundInSomeOfItsFrames) {
  const LaidOver laid = everything_laid_over()[0];
  EXPECT_GT(count(insets_in(&laid, 4, 40)), 0u);
}

TEST(PreparedFrame, AnInsetIsNoPartOfTheFieldOfView) {
  const Rgb8Image image = moved_texture(80, 60, 0, 0, 1);
  Mask insets(80, 60);
  for (int y = 10; y < 30; ++y) std::fill_n(&insets.at(20, y), 30, std::uint8_t{1});
  const Intrinsics camera = assumed_camera(80, 60, 1.2);
  const PreparedFrame with = prepare_frame(image, camera, {.halvings = 1}, {.insets = &insets});
  const PreparedFrame plain = prepare_frame(image, camera, {.halvings = 1});
  EXPECT_EQ(count(plain.field) - count(with.field), 10u * 15);
  EXPECT_FALSE(with.tissue.at(15, 10));
  EXPECT_FALSE(with.diffuse.at(15, 10));
  const Mask wrong(40, 60);
  EXPECT_THROW(prepare_frame(image, camera, {}, {.insets = &wrong}), BadDataError);
}

}  // namespace
}  // namespace organbake
