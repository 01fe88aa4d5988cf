// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include "organbake/core/parallel.h"
#include "organbake/geometry/smooth_skin.h"
#include "organbake/image/difference.h"
#include "organbake/image/srgb.h"
#include "organbake/warp/warper.h"
#include "samples/samples.h"
#include "support/synthetic_bundle.h"
#include "views_round.h"

namespace organbake {
namespace {

const Bundle& lumpy_body() {
  static const Bundle bundle = [] {
    SyntheticOptions options;
    options.organ.lump_share = 0.05;
    return make_synthetic_bundle(options);
  }();
  return bundle;
}

DrawOptions unlit_behind() {
  DrawOptions options;
  options.background = {0, 0, 0};
  return options;
}

// Straight over the proxy's faces, but curved as a shell: its normals are those of its own faces.
SmoothSkin even_skin(const TriangleMesh& proxy, std::uint32_t steps) {
  const Lattice lattice(proxy, steps);
  std::vector<std::vector<std::pair<std::uint32_t, double>>> nodes(lattice.node_count());
  for (std::uint32_t f = 0; f < proxy.faces.size(); ++f)
    each_node(steps, [&](std::uint32_t i, std::uint32_t j, std::uint32_t) {
      auto& node = nodes[lattice.node(f, i, j)];
      node.clear();
      const std::array<std::uint32_t, 3> share = {steps - i - j, i, j};
      for (int k = 0; k < 3; ++k)
        if (share[k] > 0) node.emplace_back(proxy.faces[f][k], double(share[k]) / steps);
    });
  SmoothSkin skin;
  skin.steps = steps;
  skin.first = {0};
  for (const auto& node : nodes) {
    for (const auto& [vertex, weight] : node)
      skin.carrier.push_back(vertex), skin.weight.push_back(weight);
    skin.first.push_back(static_cast<std::uint32_t>(skin.carrier.size()));
  }
  return skin;
}

// A point over a coarser organ's faces is bound to the whole one's, and its place there leads back.
TEST(CoarserOrgan, BindsWhatAPixelShowsToTheWholeSkin) {
  constexpr std::uint32_t kSteps = 3;
  constexpr double kRounding_mm = 0.02, kOnceRound = 0.05;  // one step of Newton's; of a face
  Bundle whole;
  whole.proxy = lumpy_body().proxy;
  whole.skin = even_skin(whole.proxy, kSteps);
  const CoarserOrgan coarser(whole, nullptr, 4);
  const std::vector<ShellMatrix> skin = shell_matrices(whole.shell().at_rest()),
                                 faces = shell_matrices(coarser.bundle().shell().at_rest());
  ASSERT_EQ(faces.size(), whole.proxy.faces.size());
  std::set<std::uint32_t> met;
  for (std::uint32_t face = 0; face < faces.size(); ++face)
    for (int i = 0; i < 36; ++i) {
      const float b1 = 0.03f + 0.155f * static_cast<float>(i % 6),
                  b2 = 0.03f + 0.155f * static_cast<float>(i / 6);
      if (b1 + b2 > 0.97f) continue;
      BoundPixel pixel{face, b1, b2, 0.3f};
      const Eigen::Vector3d shown = shell_point(faces[face], b1, b2, pixel.height_mm);
      coarser.bind_to_whole(pixel);
      met.insert(pixel.face);
      EXPECT_LT((shell_point(skin[pixel.face], pixel.b1, pixel.b2, pixel.height_mm) - shown).norm(),
                kRounding_mm);
      const BoundPixel back = on_drawn_skin(pixel, kSteps);
      EXPECT_EQ(back.face, face);
      EXPECT_NEAR(back.b1, b1, kOnceRound);
      EXPECT_NEAR(back.b2, b2, kOnceRound);
    }
  EXPECT_EQ(met.size(), skin.size());
}

// Every `side`² pixels as one: their mean in linear light, or the middle one of them.
Rgb8Image shrunk(const Rgb8Image& image, int side, bool mean) {
  Rgb8Image small(image.width / side, image.height / side);
  for (int i = 0; i < small.width * small.height; ++i) {
    const int x = side * (i % small.width), y = side * (i / small.width);
    const auto at = [&](int right, int down) {
      return 3 * (std::size_t(y + down) * image.width + x + right);
    };
    for (int c = 0; c < 3; ++c) {
      float sum = 0;
      for (int k = 0; k < side * side; ++k)
        sum += linear_from_srgb8()[image.pixels[at(k % side, k / side) + c]];
      small.pixels[3 * std::size_t(i) + c] =
          mean ? srgb8_from_linear(sum / static_cast<float>(side * side))
               : image.pixels[at(side / 2, side / 2) + c];
    }
  }
  return small;
}

// Of a view whose pixels are as large as four texels a side: what sixteen of a picture four times
// as large mix to, and far nearer to it than any one of them, at rest and in a dent.
TEST(CoarserOrgan, ASmallPictureShowsTheMeanOfItsTexels) {
  constexpr int kSide_px = 32, kTexels = 4;
  constexpr double kGain_db = 3;
  const Bundle& bundle = lumpy_body();
  const Eigen::Vector3d from(0.4, -1, 0.3);
  const View view = view_from(bundle, from, kSide_px);
  std::vector<std::uint8_t> within(std::size_t(kSide_px) * kSide_px);  // no outline is near
  for (int i = 0; i < kSide_px * kSide_px; ++i)
    within[i] = std::hypot(i % kSide_px - kSide_px / 2, i / kSide_px - kSide_px / 2) < kSide_px / 5;
  for (const double depth_mm : {0.0, 12.0}) {
    const auto positions = dented(bundle.proxy, from, depth_mm);
    Warper warper(bundle), one_thread(bundle);
    Frame small, large, alone;
    const DrawReport coarse = warper.draw(positions, view, unlit_behind(), small);
    const DrawReport fine =
        warper.draw(positions, view_from(bundle, from, kTexels * kSide_px), unlit_behind(), large);
    EXPECT_NEAR(coarse.texel_mm / fine.texel_mm, kTexels, 0.2);
    EXPECT_LT(double(coarse.samples_drawn) * kTexels * kTexels, 1.3 * double(fine.samples_drawn));
    const Rgb8Image mean = shrunk(large.color, kTexels, true),
                    middle = shrunk(large.color, kTexels, false);
    EXPECT_GT(compare_images(small.color, mean, within).psnr_db,
              compare_images(middle, mean, within).psnr_db + kGain_db);
    const ThreadLimit limit(1);
    one_thread.draw(positions, view, unlit_behind(), alone);
    EXPECT_EQ(alone.color.pixels, small.color.pixels);
  }
}

// Going away, where a view takes half as many texels a side as before.
TEST(CoarserOrgan, FewerTexelsAreNoJump) {
  constexpr double kStep = 1.002, kLargestMean = 0.005 * 255;
  Warper warper(lumpy_body());
  std::array<Frame, 2> frames;
  float texel_mm = 0;
  int halved = 0;
  for (double away = 1.6; away < 6; away *= kStep) {
    const View view = view_round(lumpy_body().cameras, 0.5, 0.3, away, 128, 128);
    std::swap(frames[0], frames[1]);
    const float now_mm =
        warper.draw(lumpy_body().proxy.vertices, view, unlit_behind(), frames[1]).texel_mm;
    if (texel_mm > 0 && now_mm > 1.5f * texel_mm) {
      ++halved;
      double sum = 0;
      const auto &was = frames[0].color.pixels, &is = frames[1].color.pixels;
      for (std::size_t i = 0; i < is.size(); ++i) sum += std::abs(int(is[i]) - int(was[i]));
      EXPECT_LT(sum / double(is.size()), kLargestMean) << away;
    }
    texel_mm = now_mm;
  }
  EXPECT_EQ(halved, 2);
}

}  // namespace
}  // namespace organbake
