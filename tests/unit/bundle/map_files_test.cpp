// SPDX-License-Identifier: Apache-2.0
#include "organbake/bundle/map_files.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "organbake/core/files.h"
#include "organbake/core/temporary_folder.h"
#include "organbake/image/exr.h"

namespace organbake {
namespace {

constexpr int kFileSide = 40;

// A tilted plane about 300 mm away with a background, heights of a few mm, a smooth colour.
CameraMaps some_maps() {
  CameraMaps maps;
  maps.width = maps.height = kFileSide;
  for (int y = 0; y < kFileSide; ++y) {
    for (int x = 0; x < kFileSide; ++x) {
      const bool filled = x > 3 && y > 2;
      maps.depth_mm.push_back(filled ? 300.123f + 0.377f * x - 0.19f * y
                                     : std::numeric_limits<float>::infinity());
      maps.height_mm.push_back(filled ? 3.7f * std::sin(0.3f * x + 0.2f * y) : 0.0f);
      maps.face.push_back(filled ? std::uint32_t(x / 5) : kNoFace);
      maps.confidence.push_back(filled ? 0.5f : 0.0f);
      maps.color.emplace_back(filled ? 0.4f + 0.005f * x : 0, filled ? 0.2f : 0, filled ? 0.1f : 0);
    }
  }
  return maps;
}

struct Written {
  ChannelImage depth, color, micro;
};

Written written_with(const MapPacking& packing) {
  const TemporaryFolder folder;
  PosedCamera camera;
  camera.intrinsics = {kFileSide, kFileSide, 100, 100, 20, 20};
  BaseLayer base;
  base.steps = base.face_count = 1;
  base.height_mm.assign(3, 0);
  base.color.assign(3, Eigen::Vector3f::Zero());
  base.seen_by.assign(3, 0);
  write_map_files(folder.path(), {some_maps()}, {camera}, base, packing);
  EXPECT_EQ(list_files(folder.path()).size(), 4u);
  const auto read = [&](const char* name) { return read_exr(folder.path() / "cam_000" / name); };
  return {read("depth.exr"), read("color.exr"), read("micro.exr")};
}

TEST(MapFiles, ExactPackingsGiveTheMapsBack) {
  const CameraMaps maps = some_maps();
  for (const ExrCompression compression :
       {ExrCompression::none, ExrCompression::zip, ExrCompression::piz}) {
    const Written files = written_with({.compression = compression});
    EXPECT_EQ(files.depth.floats("Y", "depth"), maps.depth_mm);
    EXPECT_EQ(files.depth.floats("Z", "depth"), maps.depth_mm);
    EXPECT_EQ(files.micro.floats("Y", "micro"), maps.height_mm);
    EXPECT_EQ(files.micro.uints("face", "micro"), maps.face);
  }
}

// PXR24 keeps 16 bits after a float's leading one: half a step is 2^-17 of the value's power of 2.
constexpr double kPxr24Depth = 256.0 / (1 << 16), kPxr24Height = 2.0 / (1 << 16);
// DWAA's default is made to be invisible: a few hundredths of a colour of 0.5, linear.
constexpr double kDwaaColor = 0.03;

TEST(MapFiles, CompactIsAsExactAsItSays) {
  const CameraMaps maps = some_maps();
  const Written files = written_with({.compact = true});
  const auto& depth = files.depth.floats("Y", "depth");
  const auto& height = files.micro.floats("Y", "micro");
  const auto& red = files.color.floats("R", "color");
  EXPECT_EQ(files.micro.uints("face", "micro"), maps.face);
  bool lost_bits = false;
  for (std::size_t i = 0; i < depth.size(); ++i) {
    if (maps.face[i] == kNoFace) {
      EXPECT_TRUE(std::isinf(depth[i]));
      continue;
    }
    EXPECT_NEAR(depth[i], maps.depth_mm[i], kPxr24Depth);
    EXPECT_NEAR(height[i], maps.height_mm[i], kPxr24Height);
    EXPECT_NEAR(red[i], maps.color[i][0], kDwaaColor);
    lost_bits = lost_bits || depth[i] != maps.depth_mm[i];
  }
  EXPECT_TRUE(lost_bits) << "this is not compact";
}

}  // namespace
}  // namespace organbake
