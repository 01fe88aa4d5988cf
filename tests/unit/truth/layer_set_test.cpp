// SPDX-License-Identifier: Apache-2.0
#include "organbake/truth/layer_set.h"

#include <gtest/gtest.h>

#include "organbake/core/error.h"

namespace organbake {
namespace {

TEST(LayerSet, ReadsNamesAndAll) {
  EXPECT_FALSE(LayerSet().any());
  const LayerSet two = layers_from("mask,depth");
  EXPECT_TRUE(two.mask && two.depth);
  EXPECT_FALSE(two.flow || two.normals || two.id || two.weight);
  std::string every;
  for (const std::string& name : layer_names()) every += (every.empty() ? "" : ",") + name;
  EXPECT_EQ(layers_from(every), layers_from("all"));
}

TEST(LayerSet, SaysWhichThereAre) {
  for (const char* wrong : {"", "Depth", "depth,", "depth mask"}) {
    try {
      layers_from(wrong);
      FAIL() << wrong;
    } catch (const UsageError& error) {
      EXPECT_NE(std::string(error.what()).find("depth, flow, normals"), std::string::npos);
    }
  }
}

}  // namespace
}  // namespace organbake
