// SPDX-License-Identifier: Apache-2.0
#include "organbake/dataset/dataset_spec.h"

#include <gtest/gtest.h>

#include "organbake/core/error.h"

namespace organbake {
namespace {

std::string spec_with(const std::string& more) {
  return R"({"schema": "organbake/dataset/1", "frames": 7)" + more + "}";
}

TEST(DatasetSpec, DefaultsAreValidAndWrittenBack) {
  const DatasetSpec spec = dataset_spec_from_json(spec_with(""), "d.json");
  EXPECT_EQ(spec.frames, 7);
  EXPECT_EQ(spec.width, 640);
  EXPECT_FALSE(spec.layers.any());
  const std::string text = dataset_spec_to_json(spec);
  EXPECT_EQ(dataset_spec_to_json(dataset_spec_from_json(text, "again.json")), text);
}

TEST(DatasetSpec, ReadsEverything) {
  const DatasetSpec spec = dataset_spec_from_json(
      spec_with(R"(, "name": "n", "seed": 9, "clip_frames": 4, "shard_frames": 8, "size": [32, 24],
        "layers": ["depth", "mask"], "stereo_mm": 5, "test_share": 0.5, "time_step_s": 0.02,
        "views": {"cone_rad": 0.3, "distance": 1, "roll_rad": 0.1, "motion_rad": 0.2},
        "pokes": {"count": [1, 2], "depth_mm": [1, 3], "radius_mm": 4, "cone_rad": 0.1},
        "lights": ["world", "scope"], "gain": [0.5, 2], "noise": 3)"),
      "d.json");
  EXPECT_TRUE(spec.layers.depth && spec.layers.mask && !spec.layers.flow);
  EXPECT_EQ(spec.most_pokes, 2);
  EXPECT_EQ(spec.radius_mm.low, 4);
  EXPECT_EQ(spec.radius_mm.high, 4);
  EXPECT_EQ(spec.lights.size(), 2u);
  const std::string text = dataset_spec_to_json(spec);
  EXPECT_EQ(dataset_spec_to_json(dataset_spec_from_json(text, "again.json")), text);
}

TEST(DatasetSpec, PicturesHaveTheSizeOfTheirLensUnlessToldOtherwise) {
  const std::string lens = R"(, "lens": {"width": 80, "height": 60, "fx": 70, "fy": 72, "cx": 41,
      "cy": 30, "distortion_k1_k2_p1_p2_k3": [-0.2, 0.05, 0.001, -0.002, 0.01],
      "vignette_exponent": 3})";
  const DatasetSpec spec = dataset_spec_from_json(spec_with(lens), "d.json");
  ASSERT_TRUE(spec.lens);
  EXPECT_EQ(spec.width, 80);
  EXPECT_EQ(spec.height, 60);
  EXPECT_EQ(spec.lens->intrinsics.p2, -0.002);
  const DatasetSpec half =
      dataset_spec_from_json(spec_with(lens + R"(, "size": [40, 30])"), "d.json");
  EXPECT_EQ(half.width, 40);
  EXPECT_EQ(half.lens->intrinsics.width, 40);
  EXPECT_EQ(half.lens->intrinsics.fx, 35);
  const std::string text = dataset_spec_to_json(half);
  EXPECT_EQ(dataset_spec_to_json(dataset_spec_from_json(text, "again.json")), text);
}

TEST(DatasetSpec, NamesWhatIsWrong) {
  const auto refusal = [](const std::string& more) -> std::string {
    try {
      dataset_spec_from_json(spec_with(more), "d.json");
    } catch (const BadDataError& error) {
      return error.what();
    }
    return "taken";
  };
  EXPECT_TRUE(refusal(R"(, "gain": [2, 1])").starts_with("d.json: /gain"));
  EXPECT_TRUE(refusal(R"(, "layers": ["deep"])").starts_with("d.json: /layers"));
  EXPECT_TRUE(refusal(R"(, "lights": ["sun"])").starts_with("d.json: /lights/0"));
  EXPECT_TRUE(refusal(R"(, "pokes": {"count": 1.5})").starts_with("d.json: /pokes/count"));
  EXPECT_TRUE(refusal(R"(, "shard_frames": 3)").starts_with("d.json: /shard_frames"));
  EXPECT_TRUE(refusal(R"(, "views": {"cone": 1})").starts_with("d.json: /views"));
  EXPECT_TRUE(refusal(R"(, "lens": {"width": 80, "height": -6})").starts_with("d.json: /lens: /h"));
  EXPECT_TRUE(refusal(R"(, "test_share": -0.1)").starts_with("d.json: /test_share"));
}

}  // namespace
}  // namespace organbake
