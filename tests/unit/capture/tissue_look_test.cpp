// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/capture/surface_color.h"

#include "baking.h"
#include "organbake/capture/solid_noise.h"
#include "organbake/core/error.h"
#include "organbake/core/random.h"
#include "support/testing.h"
#include "unit/capture/scenes.h"

namespace organbake {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr Tissue kTissues[] = {Tissue::liver,  Tissue::gallbladder, Tissue::spleen,
                               Tissue::kidney, Tissue::stomach,     Tissue::bowel,
                               Tissue::fat,    Tissue::silicone};

// Points of a plane, half a millimetre apart.
std::vector<Vector3f> patch_of(Tissue tissue, int side = 160) {
  const TissueAlbedo albedo(tissue_look(tissue));
  std::vector<Vector3f> colors;
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x)
      colors.push_back(albedo.at(Vector3d(0.5 * x, 0.5 * y, 3.3), Vector3d::UnitZ()));
  return colors;
}

float median(std::vector<Vector3f> colors, int channel) {
  const auto middle = colors.begin() + static_cast<std::ptrdiff_t>(colors.size() / 2);
  std::nth_element(colors.begin(), middle, colors.end(),
                   [&](const Vector3f& a, const Vector3f& b) { return a[channel] < b[channel]; });
  return (*middle)[channel];
}

double deviation(const std::vector<Vector3f>& colors, int channel) {
  double sum = 0, squares = 0;
  for (const Vector3f& color : colors)
    sum += color[channel], squares += color[channel] * color[channel];
  const double n = static_cast<double>(colors.size());
  return std::sqrt(std::max(0.0, squares / n - sum / n * sum / n));
}

TEST(Tissue, EachIsAnAlbedoThatALightMayFallOn) {
  for (const Tissue tissue : kTissues) {
    for (const Vector3f& color : patch_of(tissue)) {
      ASSERT_TRUE(color.allFinite());
      ASSERT_GT(color.minCoeff(), 0);
      ASSERT_LE(color.maxCoeff(), 1);
    }
  }
}

// Vessels and mottles of one patch move the median by less than a third.
TEST(Tissue, TheMedianOfAPatchIsItsAlbedo) {
  for (const Tissue tissue : kTissues) {
    const std::vector<Vector3f> colors = patch_of(tissue);
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(median(colors, c) / tissue_look(tissue).albedo[c], 1, 0.33)
          << "tissue " << static_cast<int>(tissue) << " channel " << c;
  }
}

// Of the frame that the albedo comes from, as its light is divided out: 13 %, 28 % and 27 % of the
// mean at most; the light's own slow changes are among them, so that a patch may have half of it.
TEST(Tissue, LiverVariesAsTheLiverOfAFrameDoes) {
  const std::vector<Vector3f> colors = patch_of(Tissue::liver);
  EXPECT_NEAR(deviation(colors, 0) / 0.170, 0.12, 0.06);
  EXPECT_NEAR(deviation(colors, 1) / 0.036, 0.24, 0.14);
  EXPECT_NEAR(deviation(colors, 2) / 0.037, 0.24, 0.14);
}

// Of squares of 4 mm, the least and the largest blue over green.
std::pair<double, double> blue_over_green(Tissue tissue) {
  constexpr int kSide = 320, kSquare = 8;
  const std::vector<Vector3f> colors = patch_of(tissue, kSide);
  std::pair<double, double> range = {1e9, 0};
  for (int y0 = 0; y0 < kSide; y0 += kSquare)
    for (int x0 = 0; x0 < kSide; x0 += kSquare) {
      Vector3f sum = Vector3f::Zero();
      for (int k = 0; k < kSquare * kSquare; ++k)
        sum += colors[std::size_t(y0 + k / kSquare) * kSide + x0 + k % kSquare];
      range.first = std::min<double>(range.first, sum.z() / sum.y());
      range.second = std::max<double>(range.second, sum.z() / sum.y());
    }
  return range;
}

// As 19 of 20 such squares of frames 0, 80 and 120 show it. Beyond, one tissue looks like two.
TEST(Tissue, MottlesKeepToTheHuesOfFrames) {
  const auto [lemon, lilac] = blue_over_green(Tissue::gallbladder);
  EXPECT_GT(lemon, 0.44);
  EXPECT_LT(lilac, 0.98);
  const auto [orange, pale] = blue_over_green(Tissue::fat);
  EXPECT_GT(orange, 0.32);
  EXPECT_LT(pale, 0.67);
}

// Between its vessels: no spots, and between lobules soft, darker seams.
TEST(Tissue, FatLiesInLobulesWithSoftBorders) {
  TissueLook look = tissue_look(Tissue::fat);
  look.large.share = look.small.share = 0;
  const TissueAlbedo albedo(look);
  double steps = 0, count = 0;
  std::vector<double> greens;
  for (double y = 0; y < 80; y += 1)
    for (double x = 0; x < 80; x += 0.5) {
      const auto green = [&](double at) {
        return double(albedo.at({at, y, 3.3}, Vector3d::UnitZ()).y());
      };
      greens.push_back(green(x));
      steps += std::abs(green(x + 0.5) - green(x)), ++count;
    }
  std::sort(greens.begin(), greens.end());
  const double middle = greens[greens.size() / 2];
  EXPECT_LT(steps / count / middle, 0.08);
  EXPECT_LT(greens[greens.size() / 10] / middle, 0.85);
  EXPECT_LT(greens[greens.size() * 9 / 10] / middle, 1.25);
}

TEST(Tissue, VesselsShowOnAboutTheirShareAsThinLines) {
  TissueLook look = tissue_look(Tissue::silicone);
  look.mottle = 0;
  look.tint.setZero();
  look.grain.setZero();
  look.large = {Vector3f(0, 0, 0), 10, 0.5, 1, 1};  // everywhere, black
  const TissueAlbedo albedo(look);
  int dark = 0, count = 0;
  for (double y = 0; y < 120; y += 0.2)
    for (double x = 0; x < 120; x += 0.2, ++count)
      dark += albedo.at({x, y, 7.7}, Vector3d::UnitZ()).x() < 0.5f * look.albedo.x();
  const double share = double(dark) / count;
  // Twigs that lie 10 mm apart, of 1 mm at most: 0.1…0.2 mm of them on each mm².
  EXPECT_GT(share, 0.01);
  EXPECT_LT(share, 0.16);
}

// Wide near a root, a fifth of that at the last twigs, and on again over the tile's border.
TEST(Tissue, VesselsTaperAndRepeatWithoutASeam) {
  const VesselTile tile({.side_mm = 40, .spacing_mm = 5, .width_mm = 1, .seed = 3});
  double covered = 0;
  float largest_step = 0, seam = 0;
  for (double y = 0; y < 40; y += 0.1)
    for (double x = 0; x < 40; x += 0.1) {
      const float here = tile.cover({x, y});
      EXPECT_EQ(here, tile.cover({x + 40, y - 80}));
      covered += here > 0.5f;
      largest_step = std::max(largest_step, std::abs(here - tile.cover({x + 0.02, y})));
    }
  for (double y = 0; y < 40; y += 0.1)
    seam = std::max(seam, std::abs(tile.cover({39.99, y}) - tile.cover({40.01, y})));
  EXPECT_GT(covered, 0.02 * 400 * 400);
  EXPECT_LT(covered, 0.2 * 400 * 400);
  EXPECT_LE(seam, largest_step);
  EXPECT_LT(largest_step, 0.15f) << "texels of 0.3 mm would hit a twig or not";
}

// Twigs narrower than a texel are as wide and fainter: what they cover in all stays.
TEST(Tissue, ThinVesselsCoverAsMuchAsTheirWidthSays) {
  const auto mean_cover = [](double scale) {
    constexpr int kSide = 400;
    const VesselTile tile(
        {.side_mm = 40 * scale, .spacing_mm = 5 * scale, .width_mm = scale, .seed = 3});
    double sum = 0;
    for (int k = 0; k < kSide * kSide; ++k)
      sum += tile.cover(0.1 * scale * Vector2d(k % kSide, k / kSide));
    return sum / (kSide * kSide);
  };
  const double wide = mean_cover(8);
  EXPECT_NEAR(mean_cover(0.5), wide, 0.1 * wide);
}

TEST(Tissue, TheNamedMaterialIsAlbedoTimesItsLight) {
  Material material;
  material.tissue = Tissue::kidney;
  const auto color = make_material_color(material);
  const Vector3d point(3, 1, 4), normal = Vector3d(0.2, -0.5, 0.7).normalized();
  std::vector<Vector3f> colors;
  color->shade({point}, {normal}, {{}}, colors);
  const Lighting lighting = material.lighting();
  const Vector3f albedo = TissueAlbedo(tissue_look(Tissue::kidney)).at(point, normal);
  EXPECT_LT((colors[0] - albedo.cwiseProduct(lighting.diffuse(normal).cast<float>())).norm(), 1e-6);
  EXPECT_TRUE(lighting.scope);
  EXPECT_FALSE(lighting.gloss.empty());
}

TEST(Tissue, ThePlainMaterialKeepsItsLightOfTheWorldAlone) {
  const Lighting lighting = Material().lighting();
  EXPECT_FALSE(lighting.scope);
  EXPECT_TRUE(lighting.gloss.empty());
}

TEST(Tissue, WhatIsOfThePlainMaterialIsRefusedBesideATissuesName) {
  const auto refused = [](auto change) {
    Material material;
    material.tissue = Tissue::liver;
    EXPECT_NO_THROW(material.check());
    change(material);
    EXPECT_THROW(material.check(), UsageError);
  };
  refused([](Material& m) { m.albedo = {0.1f, 0.2f, 0.3f}; });
  refused([](Material& m) { m.variation = 0.5f; });
  refused([](Material& m) { m.feature_mm = 3; });
}

TEST(Material, DefaultsAreValid) { EXPECT_NO_THROW(Material().check()); }

TEST(Material, EachBoundIsKept) {
  const auto refused = [](auto change) {
    Material material;
    change(material);
    EXPECT_THROW(material.check(), UsageError);
    EXPECT_THROW(make_material_color(material), UsageError);
  };
  const float not_a_number = std::numeric_limits<float>::quiet_NaN();
  refused([](auto& m) { m.albedo[0] = -0.1f; });
  refused([](auto& m) { m.albedo[2] = 1.1f; });
  refused([&](auto& m) { m.albedo[1] = not_a_number; });
  refused([](auto& m) { m.variation = 2; });
  refused([&](auto& m) { m.variation = not_a_number; });
  refused([](auto& m) { m.feature_mm = 0; });
  refused([&](auto& m) { m.feature_mm = not_a_number; });
  refused([](auto& m) { m.ambient = -1; });
  refused([](auto& m) { m.light_direction.setZero(); });
  refused([](auto& m) { m.light_direction[0] = std::numeric_limits<double>::infinity(); });
}

TEST(Material, WithoutVariationItIsAlbedoTimesLight) {
  Material material;
  material.variation = 0;
  material.light_direction = {0, 0, 4};
  const auto color = make_material_color(material);
  std::vector<Eigen::Vector3f> colors;
  color->shade({Vector3d(1, 2, 3), Vector3d(4, 5, 6), Vector3d(7, 8, 9)},
               {Vector3d::UnitZ(), Vector3d::UnitX(), -Vector3d::UnitZ()}, {{}, {}, {}}, colors);
  ASSERT_EQ(colors.size(), 3u);
  EXPECT_LT((colors[0] - material.albedo).norm(), 1e-6);
  EXPECT_LT((colors[1] - 0.35f * material.albedo).norm(), 1e-6);
  EXPECT_LT((colors[2] - 0.35f * material.albedo).norm(), 1e-6);
}

TEST(Material, VariesWithinReasonAndNeverBelowZero) {
  Material material;
  material.variation = 1;
  const auto color = make_material_color(material);
  const TriangleMesh sphere = sphere_mesh(40, 4);
  double least = 1, most = 0;
  for (const auto& sample :
       shade_through(sphere, *color, plain_camera({0, -150, 0}, Vector3d::Zero(), 64))) {
    EXPECT_TRUE(sample.color.allFinite());
    EXPECT_GE(sample.color.minCoeff(), 0);
    least = std::min<double>(least, sample.color.x());
    most = std::max<double>(most, sample.color.x());
  }
  EXPECT_GT(most, 2 * least);
}

Vector3d random_point(RandomStream& random) {
  return {random.uniform(-90, 90), random.uniform(-90, 90), random.uniform(-90, 90)};
}

TEST(SolidNoise, IsCentredWithItsDocumentedSpread) {
  const SolidNoise noise(3, 4.0);
  RandomStream random(1);
  double sum = 0, sum2 = 0, largest = 0;
  constexpr int kPoints = 100000;
  for (int i = 0; i < kPoints; ++i) {
    const double value = noise.value(random_point(random));
    sum += value;
    sum2 += value * value;
    largest = std::max(largest, std::abs(value));
  }
  EXPECT_NEAR(sum / kPoints, 0, 0.005);
  EXPECT_NEAR(std::sqrt(sum2 / kPoints), 0.19, 0.01);
  EXPECT_LT(largest, 1.5);
}

TEST(SolidNoise, GradientIsTheValuesSlopeAlsoAcrossCells) {
  const SolidNoise noise(3, 4.0);
  RandomStream random(2);
  constexpr double kStep = 1e-5;
  for (int i = 0; i < 2000; ++i) {
    Vector3d point = random_point(random);
    if (i % 4 == 0) point[i % 3] = 4.0 * std::round(point[i % 3] / 4.0);  // on a cell's wall
    const NoiseSample at = noise.sample(point);
    EXPECT_NEAR(at.value, noise.value(point), 1e-14);
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d step = kStep * Vector3d::Unit(axis);
      const double slope = (noise.value(point + step) - noise.value(point - step)) / (2 * kStep);
      EXPECT_NEAR(at.gradient_per_mm[axis], slope, 1e-7);
    }
  }
}

TEST(SolidNoise, AbsurdPointsAreZero) {
  const SolidNoise noise(1, 4.0);
  for (const double value : {1e300, -1e12, std::numeric_limits<double>::infinity(),
                             std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_EQ(noise.value(Vector3d(0.3, value, 0.2)), 0);
    EXPECT_EQ(noise.sample(Vector3d(value, 0.1, 0.2)).gradient_per_mm.norm(), 0);
  }
}

}  // namespace
}  // namespace organbake
