// SPDX-License-Identifier: Apache-2.0
#include "organbake/bundle/base_layer.h"

#include <gtest/gtest.h>

#include <limits>

#include "organbake/core/error.h"

namespace organbake {
namespace {

TEST(BaseNodeIndex, CountsEveryNodeOnceInOrder) {
  for (std::uint32_t n : {1u, 2u, 7u, 64u}) {
    std::uint32_t expected = 0;
    for (std::uint32_t i = 0; i <= n; ++i) {
      for (std::uint32_t j = 0; i + j <= n; ++j) EXPECT_EQ(base_node_index(n, i, j), expected++);
    }
    EXPECT_EQ(expected, (n + 1) * (n + 2) / 2);
  }
}

TEST(BaseLayer, SurvivesItsImage) {
  BaseLayer layer{3, 2, {}, {}, {}};
  for (std::uint32_t i = 0; i < 2 * layer.nodes_per_face(); ++i) {
    layer.height_mm.push_back(0.5f * static_cast<float>(i));
    layer.color.emplace_back(0.25f, 0.5f, static_cast<float>(i) / 32);
    layer.seen_by.push_back(i * 7);
  }
  const BaseLayer back = base_layer_from_image(base_layer_to_image(layer), "base", 2);
  EXPECT_EQ(back.steps, 3u);
  EXPECT_EQ(back.height_mm, layer.height_mm);
  EXPECT_EQ(back.color, layer.color);
  EXPECT_EQ(back.seen_by, layer.seen_by);
}

TEST(BaseLayer, RefusesOtherShapes) {
  BaseLayer layer{1, 2, std::vector<float>(6), std::vector<Eigen::Vector3f>(6, {0, 0, 0}),
                  std::vector<std::uint32_t>(6)};
  ChannelImage image = base_layer_to_image(layer);
  EXPECT_THROW(base_layer_from_image(image, "base", 3), BadDataError);
  ChannelImage narrow = image;
  narrow.width = 4;  // no triangular number
  EXPECT_THROW(base_layer_from_image(narrow, "base", 2), BadDataError);
  layer.height_mm[5] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(base_layer_from_image(base_layer_to_image(layer), "base", 2), BadDataError);
}

}  // namespace
}  // namespace organbake
