// SPDX-License-Identifier: Apache-2.0
#include "finishing/post_process.h"

#include "organbake/core/parallel.h"
#include "organbake/core/random.h"
#include "organbake/image/srgb.h"
#include "organbake/warp/view.h"
#include "support/testing.h"
#include "views_round.h"

namespace organbake {
namespace {

PixelBox whole(const Frame& frame) { return {0, 0, frame.color.width, frame.color.height}; }

void soften(const PixelBox& box, Outline& outline, Frame& frame, KeptPixels& kept) {
  CoverMask skin;
  skin.read(box, frame);
  FrontEdges edges;
  edges.find(skin);
  outline.soften(edges, frame, kept);
}
void soften(const PixelBox& box, Frame& frame) {
  Outline outline;
  KeptPixels kept;
  soften(box, outline, frame, kept);
}

double true_share(const Inside& inside, int x, int y) {
  constexpr int kRays = 32;
  int hits = 0;
  for (int j = 0; j < kRays; ++j)
    for (int i = 0; i < kRays; ++i) hits += inside(x + (i + 0.5) / kRays, y + (j + 0.5) / kRays);
  return double(hits) / (kRays * kRays);
}

struct ShareErrors {
  double mean = 0, rms = 0, largest = 0;
};

// Of white's share of the light, over pixels that the outline crosses or that are neither black nor
// white, `margin` inside the picture.
ShareErrors share_errors(const Frame& frame, const Inside& inside, int margin) {
  ShareErrors errors;
  int pixels = 0;
  for (int y = margin; y < frame.color.height - margin; ++y) {
    for (int x = margin; x < frame.color.width - margin; ++x) {
      const double share = true_share(inside, x, y);
      const double shown = linear_from_srgb8()[frame.color.at(x, y)[0]];
      if (share == shown) continue;
      errors.mean += shown - share;
      errors.rms += (shown - share) * (shown - share);
      errors.largest = std::max(errors.largest, std::abs(shown - share));
      ++pixels;
    }
  }
  errors.mean /= pixels;
  errors.rms = std::sqrt(errors.rms / pixels);
  return errors;
}

Inside disc(double radius, double x0, double y0) {
  return [=](double x, double y) { return std::hypot(x - x0, y - y0) < radius; };
}

TEST(Outline, OfDiscsHasNearlyTheTrueShares) {
  for (const double radius : {20.7, 60.3, 95.4}) {
    const Inside inside = disc(radius, 100.2, 100.9);
    Frame frame = white_on_black(201, 203, inside);
    const ShareErrors sharp = share_errors(frame, inside, 0);
    smooth_outlines(frame);
    const ShareErrors soft = share_errors(frame, inside, 0);
    EXPECT_LT(soft.rms, 0.45 * sharp.rms) << radius;
    EXPECT_LT(std::abs(soft.mean), 0.045) << radius;
  }
}

TEST(Outline, OfLinesOnWholeStepsIsExact) {
  constexpr double kRounding = 0.015;  // of shares to 1/254 and of light to 8 bits
  constexpr int kMargin = 20;  // the last stretch before the picture's rim has one end alone
  for (const int run : {1, 2, 3, 5, 8}) {
    // Through the middles of the steps' risers.
    const Inside below = [=](double x, double y) { return (x - run / 2.0) / run + 40 < y; };
    Frame frame = white_on_black(120, 120, below);
    smooth_outlines(frame);
    EXPECT_LT(share_errors(frame, below, kMargin).largest, kRounding) << run;
  }
}

TEST(Outline, IsTheSameMirroredAndTransposed) {
  const Inside inside = [](double x, double y) {
    return std::hypot(x - 30.3, 1.7 * (y - 25.1)) < 22 + 2 * std::sin(0.8 * x);
  };
  Frame frame = white_on_black(61, 52, inside);
  Frame mirrored = white_on_black(61, 52, [&](double x, double y) { return inside(61 - x, y); });
  Frame upside_down = white_on_black(61, 52, [&](double x, double y) { return inside(x, 52 - y); });
  Frame transposed = white_on_black(52, 61, [&](double x, double y) { return inside(y, x); });
  for (Frame* each : {&frame, &mirrored, &upside_down, &transposed}) smooth_outlines(*each);
  for (int y = 0; y < 52; ++y) {
    for (int x = 0; x < 61; ++x) {
      const int value = frame.color.at(x, y)[0];
      EXPECT_EQ(mirrored.color.at(60 - x, y)[0], value);
      EXPECT_EQ(upside_down.color.at(x, 51 - y)[0], value);
      EXPECT_EQ(transposed.color.at(y, x)[0], value);
    }
  }
}

TEST(Outline, IsTakenBack) {
  Outline outline;
  const Frame sharp = white_on_black(90, 70, disc(28.4, 44, 33));
  Frame frame = sharp;
  for (int round = 0; round < 2; ++round) {
    KeptPixels kept;
    soften(whole(frame), outline, frame, kept);
    EXPECT_NE(frame.color.pixels, sharp.color.pixels);
    EXPECT_EQ(frame.cover, sharp.cover);
    kept.restore(frame);
    EXPECT_EQ(frame.color.pixels, sharp.color.pixels);
  }
}

// Wherever a word of 64 pixels begins, and however large the box about the skin is.
TEST(Outline, DoesNotDependOnTheBox) {
  Frame frame = white_on_black(300, 80, disc(30.2, 140.4, 41.3));
  Frame tight = frame, shifted = frame;
  smooth_outlines(frame);
  soften({110, 11, 171, 72}, tight);
  soften({33, 2, 288, 80}, shifted);
  EXPECT_EQ(tight.color.pixels, frame.color.pixels);
  EXPECT_EQ(shifted.color.pixels, frame.color.pixels);
}

TEST(Outline, AgainstToolsStaysAsItIs) {
  Frame frame = white_on_black(60, 60, disc(20.3, 30, 30));
  for (auto& cover : frame.cover)
    if (cover == Cover::background) cover = Cover::solid;
  const auto before = frame.color.pixels;
  smooth_outlines(frame);
  EXPECT_EQ(frame.color.pixels, before);
}

TEST(Outline, OfNothingAllOrOnePixelIsNothing) {
  for (const auto& [width, height] : {std::pair{1, 1}, {1, 7}, {64, 1}, {65, 3}}) {
    for (const bool all : {false, true}) {
      Frame frame = white_on_black(width, height, [&](double, double) { return all; });
      const auto before = frame.color.pixels;
      smooth_outlines(frame);
      EXPECT_EQ(frame.color.pixels, before);
    }
  }
  Frame empty;
  soften(PixelBox{}, empty);
}

TEST(Outline, TakesTheBackgroundsColour) {
  const std::array<std::uint8_t, 3> blue = {0, 0, 255};
  Frame frame = white_on_black(60, 60, disc(20.3, 30, 30));
  for (std::size_t i = 0; i < frame.cover.size(); ++i)
    if (frame.cover[i] == Cover::background)
      std::copy(blue.begin(), blue.end(), &frame.color.pixels[3 * i]);
  smooth_outlines(frame);
  int mixed = 0;
  for (std::size_t i = 0; i < frame.cover.size(); ++i) {
    const std::uint8_t* rgb = &frame.color.pixels[3 * i];
    EXPECT_EQ(rgb[0], rgb[1]);
    EXPECT_EQ(rgb[2], 255) << "white and blue";
    mixed += rgb[0] > 0 && rgb[0] < 255;
  }
  EXPECT_GT(mixed, 100);
}

using DepthAt = std::function<float(int x, int y)>;
constexpr float kDeeper_mm = 2;

// The skin of the frame, by its depth.
void soften_by_depth(Frame& frame, const DepthAt& depth_at) {
  const int width = frame.color.width, height = frame.color.height;
  std::vector<float> depth_mm;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) depth_mm.push_back(depth_at(x, y));
  const SkinDepth depth = SkinDepth::of(depth_mm, width, 400);
  smooth_outlines(frame, &depth, kDeeper_mm);
}
// All of it skin.
void soften_inside(Frame& frame, const DepthAt& depth_at) {
  std::fill(frame.cover.begin(), frame.cover.end(), Cover::samples);
  soften_by_depth(frame, depth_at);
}

TEST(Outline, BeforeFartherSkinIsAsBeforeTheBackground) {
  const Inside inside = disc(40.3, 60.4, 50.2);
  Frame before_open = white_on_black(150, 110, inside);
  Frame before_skin = before_open;
  smooth_outlines(before_open);
  soften_inside(before_skin, [&](int x, int y) { return inside(x + 0.5, y + 0.5) ? 100 : 140; });
  EXPECT_EQ(before_skin.color.pixels, before_open.color.pixels);
}

// A ball before a slanted wall, as deep as it looks: its own skin falls away fast towards its
// outline.
TEST(Outline, OfABallBeforeAWallIsFound) {
  constexpr double kRadius = 40.3, kX = 60.4, kY = 50.2;
  const Inside inside = disc(kRadius, kX, kY);
  Frame before_open = white_on_black(150, 110, inside);
  Frame before_wall = before_open;
  smooth_outlines(before_open);
  soften_inside(before_wall, [&](int x, int y) {
    const double px = x + 0.5 - kX, py = y + 0.5 - kY, gone = px * px + py * py;
    const double ball = kRadius * kRadius - gone;
    return static_cast<float>(ball > 0 ? 150 - std::sqrt(ball) : 170 + 0.3 * px);
  });
  EXPECT_EQ(before_wall.color.pixels, before_open.color.pixels);
}

// The last pixel of a ball falls far, and nothing goes on behind it.
TEST(Outline, BeforeTheBackgroundIsAllThatABallHas) {
  constexpr double kRadius = 40.3, kX = 60.4, kY = 50.2;
  Frame by_cover = white_on_black(150, 110, disc(kRadius, kX, kY));
  Frame by_depth = by_cover;
  smooth_outlines(by_cover);
  soften_by_depth(by_depth, [&](int x, int y) {
    const double px = x + 0.5 - kX, py = y + 0.5 - kY;
    const double ball = kRadius * kRadius - px * px - py * py;
    return ball > 0 ? static_cast<float>(150 - std::sqrt(ball))
                    : std::numeric_limits<float>::infinity();
  });
  EXPECT_EQ(by_depth.color.pixels, by_cover.color.pixels);
}

TEST(Outline, OfSlopesAndSmallStepsIsNone) {
  const Inside inside = disc(40.3, 60.4, 50.2);
  const auto slope = [](int x, int) { return 100 + 1.2f * kDeeper_mm * static_cast<float>(x); };
  const auto terrace = [&](int x, int y) {
    return inside(x + 0.5, y + 0.5) ? 100 : 100 + 0.9f * kDeeper_mm;
  };
  for (const DepthAt& depth : {DepthAt(slope), DepthAt(terrace)}) {
    Frame frame = white_on_black(110, 110, inside);
    const auto before = frame.color.pixels;
    soften_inside(frame, depth);
    EXPECT_EQ(frame.color.pixels, before);
  }
}

// Half a pixel of each is on one side, by symmetry; together as much as the figure has.
TEST(OutlineAreas, AddUpToTheWholeStretch) {
  constexpr double kRounding = 1e-12;
  for (const int length : {1, 2, 3, 4, 7, 20}) {
    OutlineAreas slope, straight_bow, high_bow;
    for (int i = 0; i < length; ++i) {
      for (const auto& [sum, areas] :
           {std::pair{&slope, areas_of_slope(length, to_open, to_skin, i)},
            {&straight_bow, areas_of_bow(length, to_open, 0.5, i)},
            {&high_bow, areas_of_bow(length, to_skin, 1, i)}}) {
        EXPECT_GE(std::min(areas.of_open, areas.of_skin), -kRounding);
        EXPECT_LE(areas.of_open + areas.of_skin, 0.5 + kRounding);
        sum->of_open += areas.of_open, sum->of_skin += areas.of_skin;
      }
    }
    EXPECT_NEAR(slope.of_open, length / 8.0, kRounding);  // a triangle
    EXPECT_NEAR(slope.of_skin, length / 8.0, kRounding);
    EXPECT_NEAR(straight_bow.of_open, length / 6.0,
                kRounding);  // between a parabola and its tangent
    EXPECT_NEAR(straight_bow.of_skin, 0, kRounding);
    EXPECT_NEAR(high_bow.of_open - high_bow.of_skin, length * (2 / 3.0 - 0.5), kRounding);
  }
}

constexpr int kPictureWidth = 600, kPictureHeight = 80;
constexpr float kDeeperMm = 4;

struct TerracePicture {
  Frame frame;
  SkinDepth depth;

  TerracePicture() {
    depth.resize(kPictureWidth, kPictureHeight, 400);
    set_depth(0, 0, kPictureWidth, kPictureHeight, 100);
    frame.color = Rgb8Image(kPictureWidth, kPictureHeight);
    frame.cover.assign(std::size_t(kPictureWidth) * kPictureHeight, Cover::samples);
  }
  void set_depth(int x0, int y0, int x1, int y1, float mm) {
    const std::vector<float> row(whole_vectors(x1 - x0), mm);
    for (int y = y0; y < y1; ++y) depth.put(x0, y, x1 - x0, row.data());
  }
  std::size_t open(const PixelBox& box = {0, 0, kPictureWidth, kPictureHeight}) {
    const auto found = find_see_through(box, depth, kDeeperMm);
    EXPECT_TRUE(std::is_sorted(found.begin(), found.end()));
    for (const std::uint32_t pixel : found) frame.cover[pixel] = Cover::background;
    return found.size();
  }
};

TEST(SeeThrough, OpensSlitsAlongRowsAndColumns) {
  TerracePicture picture;
  picture.set_depth(20, 10, 400, 12, 150);  // two pixels high, across blocks
  picture.set_depth(500, 20, 501, 70, 150);
  picture.set_depth(300, 40, 301, 41, 150);
  EXPECT_EQ(picture.open(), 380u * 2 + 50 + 1);
  EXPECT_FALSE(picture.frame.covered(20, 11));
  EXPECT_FALSE(picture.frame.covered(500, 69));
  EXPECT_TRUE(picture.frame.covered(499, 69));
}

TEST(SeeThrough, LeavesStepsSlopesAndWideGapsAlone) {
  TerracePicture picture;
  picture.set_depth(0, 0, 100, kPictureHeight, 150);  // a step: an outline before something farther
  picture.set_depth(200, 20, 206, 60, 150);           // a gap between two lobes
  for (int x = 300; x < 400; ++x)
    picture.set_depth(x, 0, x + 1, kPictureHeight, 100 + 1.5f * (x - 300));
  EXPECT_EQ(picture.open(), 0u);
}

TEST(SeeThrough, TheBackgroundIsNoSide) {
  TerracePicture picture;
  picture.set_depth(50, 0, 52, kPictureHeight, 150);
  picture.depth.clear({0, 0, 50, kPictureHeight});
  // The picture's border is none, either.
  picture.set_depth(kPictureWidth - 1, 0, kPictureWidth, kPictureHeight, 150);
  picture.set_depth(0, 0, kPictureWidth, 1, 150);
  EXPECT_EQ(picture.open(), 0u);
}

TEST(SeeThrough, SkinBeyondTheReachIsOneDepth) {
  TerracePicture picture;
  picture.set_depth(0, 0, kPictureWidth, kPictureHeight, 500);
  picture.set_depth(50, 0, 52, kPictureHeight, 1e30f);
  EXPECT_EQ(picture.open(), 0u);
  picture.set_depth(0, 0, kPictureWidth, kPictureHeight, 390);
  picture.set_depth(50, 0, 52, kPictureHeight, 1e30f);
  EXPECT_EQ(picture.open(), 2u * kPictureHeight);
}

TEST(SeeThrough, LooksBeyondTheBoxButFindsNothingThere) {
  TerracePicture picture;
  picture.set_depth(100, 0, 102, kPictureHeight, 150);
  EXPECT_EQ(picture.open({101, 10, 300, 20}), 10u);
  EXPECT_EQ(picture.open({60, 10, 101, 20}), 10u);
  EXPECT_EQ(picture.open({102, 10, 300, 20}), 0u);
}

TEST(SeeThrough, IsTheSameForAnyNumberOfThreads) {
  RandomStream random(7);
  TerracePicture one;
  for (int y = 0; y < kPictureHeight; ++y) {
    for (int x = 0; x < kPictureWidth; ++x)
      one.set_depth(x, y, x + 1, y + 1, random.uniform(0, 1) < 0.1 ? 150.0f : 100.0f);
  }
  TerracePicture two = one;
  {
    const ThreadLimit limit(1);
    EXPECT_GT(one.open(), 0u);
  }
  two.open();
  EXPECT_EQ(one.frame.cover, two.frame.cover);
}

}  // namespace
}  // namespace organbake
