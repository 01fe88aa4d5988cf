// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/capture/surface_color.h"

#include "baking.h"
#include "organbake/capture/solid_noise.h"
#include "organbake/core/error.h"
#include "organbake/image/srgb.h"
#include "support/testing.h"

namespace organbake {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

// Tissue with grain of two colours, lit from one side, with highlights and a black surround.
struct Photograph {
  int width = 240, height = 180, border = 0;
  double light = 0, highlights = 0;

  ExemplarPhoto made(double mm_per_pixel = 0.2) const {
    const SolidNoise red(1, 5), green(2, 3), spots(3, 40);
    ExemplarPhoto photo{Rgb8Image(width, height), {}, mm_per_pixel};
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const Vector3d at(x, y, 0.5);
        const double r = red.value(at), g = green.value(at);
        Vector3d color(0.18 * (1 + 0.6 * r), 0.05 * (1 + 0.9 * g + 0.5 * r), 0.05 * (1 + 0.8 * g));
        color *= 1 + light * (double(x) / width - 0.5);
        if (spots.value(at) > 0.4 - highlights) color = Vector3d::Ones();
        const bool inside = x >= border && y >= border && x < width - border && y < height - border;
        for (int c = 0; c < 3; ++c)
          photo.image.at(x, y)[c] =
              inside ? srgb8_from_linear(static_cast<float>(color[c])) : std::uint8_t{0};
      }
    }
    return photo;
  }
};

// Of a plane and of a ball, so that planes blend.
std::vector<Vector3f> points_of(const ExemplarTexture& texture) {
  std::vector<Vector3f> colors;
  for (double y = -40; y < 40; y += 0.53)
    for (double x = -40; x < 40; x += 0.53) {
      const Vector3d normal = Vector3d(x / 45, y / 45, 0.6).normalized();
      colors.push_back(texture.at(Vector3d(x, y, 9), Vector3d::UnitZ()));
      colors.push_back(texture.at(60 * normal, normal));
    }
  return colors;
}

std::vector<float> channel(const std::vector<Vector3f>& colors, int c) {
  std::vector<float> values;
  for (const Vector3f& color : colors) values.push_back(color[c]);
  std::sort(values.begin(), values.end());
  return values;
}

// The largest difference of two distributions (Kolmogorov and Smirnov).
double histogram_distance(const std::vector<float>& a, const std::vector<float>& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const auto below = std::upper_bound(b.begin(), b.end(), a[i]) - b.begin();
    const auto own = std::upper_bound(a.begin(), a.end(), a[i]) - a.begin();
    largest = std::max(largest, std::abs(double(below) / b.size() - double(own) / a.size()));
  }
  return largest;
}

double median_of(const std::vector<float>& sorted) { return sorted[sorted.size() / 2]; }

TEST(Exemplar, TheTextureHasTheTissuesHistograms) {
  const ExemplarTexture texture{Exemplar(Photograph().made())};
  const auto colors = points_of(texture);
  for (int c = 0; c < 3; ++c)
    EXPECT_LT(histogram_distance(channel(colors, c), channel(texture.exemplar().tissue(), c)), 0.04)
        << "channel " << c;
}

TEST(Exemplar, LightAndHighlightsAreTakenOut) {
  const ExemplarTexture even{Exemplar(Photograph().made())};
  Photograph lit;
  lit.light = 1.2, lit.highlights = 0.06, lit.border = 12;
  const ExemplarTexture texture{Exemplar(lit.made())};
  EXPECT_GT(texture.exemplar().highlight_share(), 0.005);
  const auto tissue = channel(texture.exemplar().tissue(), 0);
  EXPECT_LT(tissue.back(), 0.45) << "a highlight was left";
  const auto expected = channel(even.exemplar().tissue(), 0);
  const auto spread = [](const std::vector<float>& sorted) {
    return double(sorted[sorted.size() * 9 / 10]) / sorted[sorted.size() / 10];
  };
  EXPECT_NEAR(median_of(tissue) / median_of(expected), 1, 0.1);
  // The light alone would spread it by three to one more.
  EXPECT_NEAR(spread(tissue) / spread(expected), 1, 0.15);
}

// A photograph whose left quarter is yellow, in light that changes threefold over it.
TEST(Exemplar, TissuesOfAnotherHueAreToldWithTheirShares) {
  Photograph lit;
  lit.light = 1;
  ExemplarPhoto photo = lit.made();
  ASSERT_EQ(tissues_shown(photo).size(), 1u) << "grain and light are no tissues";
  const int quarter = lit.width / 4;
  for (int y = 0; y < lit.height; ++y)
    for (int x = 0; x < quarter; ++x) {
      const float red = linear_from_srgb8()[photo.image.at(x, y)[0]];
      photo.image.at(x, y)[1] = srgb8_from_linear(red / 1.4f);
    }
  const std::vector<ShownTissue> tissues = tissues_shown(photo);
  ASSERT_EQ(tissues.size(), 2u);
  EXPECT_NEAR(tissues[0].share, 0.75, 0.03);
  EXPECT_NEAR(tissues[1].share, 0.25, 0.03);
  EXPECT_NEAR(tissues[1].color[0] / tissues[1].color[1], 1.4, 0.1);
  photo.mask.assign(std::size_t(lit.width) * lit.height, 0);
  for (int y = 0; y < lit.height; ++y)
    for (int x = quarter; x < lit.width; ++x) photo.mask[std::size_t(y) * lit.width + x] = 1;
  EXPECT_EQ(tissues_shown(photo).size(), 1u) << "a mask chooses one";
}

TEST(Exemplar, TheTextureDoesNotRepeat) {
  const ExemplarTexture texture{Exemplar(Photograph().made())};
  const double cell = texture.exemplar().reach_mm();
  const auto row = [&](double shift_mm) {
    std::vector<double> values;
    for (double y = 0; y < 12; y += 0.3)
      for (double x = 0; x < 12; x += 0.3)
        values.push_back(texture.at({x + shift_mm, y, 0}, Vector3d::UnitZ()).x());
    return values;
  };
  const auto correlation = [](const std::vector<double>& a, const std::vector<double>& b) {
    double ma = 0, mb = 0, ab = 0, aa = 0, bb = 0;
    for (std::size_t i = 0; i < a.size(); ++i) ma += a[i] / a.size(), mb += b[i] / b.size();
    for (std::size_t i = 0; i < a.size(); ++i) {
      ab += (a[i] - ma) * (b[i] - mb), aa += (a[i] - ma) * (a[i] - ma);
      bb += (b[i] - mb) * (b[i] - mb);
    }
    return ab / std::sqrt(aa * bb);
  };
  const auto here = row(0);
  EXPECT_NEAR(correlation(here, row(0)), 1, 1e-9);
  // 1,600 points of grains of about ten: chance alone gives 0.08 and less in most cases.
  for (int cells = 1; cells <= 12; ++cells)
    EXPECT_LT(std::abs(correlation(here, row(cells * cell))), 0.35) << cells << " cells on";
}

TEST(Exemplar, TheMaskKeepsOtherTissueOut) {
  ExemplarPhoto photo = Photograph().made();
  photo.mask.assign(std::size_t(photo.image.width) * photo.image.height, 1);
  for (int y = 0; y < photo.image.height; ++y)
    for (int x = 0; x < photo.image.width / 2; ++x) {
      std::uint8_t* const rgb = photo.image.at(x, y);
      rgb[0] = 20, rgb[1] = 190, rgb[2] = 30;  // a green cloth
      photo.mask[std::size_t(y) * photo.image.width + x] = 0;
    }
  const ExemplarTexture texture{Exemplar(photo)};
  for (const Vector3f& color : points_of(texture)) ASSERT_LT(color.y(), color.x());
}

TEST(Exemplar, WhatShowsNoTissueIsRefused) {
  const auto refused = [](const ExemplarPhoto& photo) {
    EXPECT_THROW(Exemplar{photo}, BadDataError);
  };
  ExemplarPhoto photo = Photograph().made();
  std::fill(photo.image.pixels.begin(), photo.image.pixels.end(), std::uint8_t{255});
  refused(photo);  // all highlight
  std::fill(photo.image.pixels.begin(), photo.image.pixels.end(), std::uint8_t{0});
  refused(photo);
  Photograph tiny;
  tiny.width = tiny.height = 3;
  refused(tiny.made());
  Photograph strip;  // enough pixels, nowhere a piece
  strip.width = 2000, strip.height = 6;
  refused(strip.made());
  photo = Photograph().made();
  photo.mask.assign(100, 1);
  refused(photo);
  photo.mask.assign(std::size_t(photo.image.width) * photo.image.height, 0);
  refused(photo);
}

TEST(Exemplar, AScaleThatCannotBeIsRefused) {
  for (const double scale : {0.0, -1.0, 1e9, std::nan("")})
    EXPECT_THROW(Exemplar{Photograph().made(scale)}, UsageError) << scale;
}

TEST(Exemplar, OneColourGivesThatColour) {
  ExemplarPhoto photo = Photograph().made();
  for (std::size_t i = 0; i < photo.image.pixels.size(); i += 3)
    photo.image.pixels[i] = 120, photo.image.pixels[i + 1] = 50, photo.image.pixels[i + 2] = 55;
  const ExemplarTexture texture{Exemplar(photo)};
  for (const Vector3f& color : points_of(texture))
    ASSERT_LT((color -
               Vector3f(linear_from_srgb8()[120], linear_from_srgb8()[50], linear_from_srgb8()[55]))
                  .norm(),
              1e-3);
}

TEST(Exemplar, TheLookIsTheTextureInTheMaterialsLight) {
  Material material;
  material.tissue = Tissue::spleen;
  const ExemplarLook look = make_exemplar_color(Photograph().made(), material);
  EXPECT_EQ(look.lighting.finish, tissue_look(Tissue::spleen).finish);
  EXPECT_TRUE(look.lighting.scope);
  const Vector3d point(4, -3, 2), normal = Vector3d(0.1, 0.7, -0.4).normalized();
  std::vector<Vector3f> colors;
  look.color->shade({point}, {normal}, {{}}, colors);
  const Vector3f albedo = ExemplarTexture(Exemplar(Photograph().made())).at(point, normal);
  EXPECT_LT((colors[0] - albedo.cwiseProduct(look.lighting.diffuse(normal).cast<float>())).norm(),
            1e-6);
}

}  // namespace
}  // namespace organbake
