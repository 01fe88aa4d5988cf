// SPDX-License-Identifier: Apache-2.0
#include "dataset_plan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

namespace organbake {
namespace {

DatasetPlan plan_of(int frames, std::size_t organs, double test_share, std::uint64_t seed = 1) {
  DatasetSpec spec;
  spec.frames = frames;
  spec.clip_frames = 4;
  spec.shard_frames = 10;  // holds two clips
  spec.test_share = test_share;
  spec.seed = seed;
  return plan_dataset(spec, std::vector<std::filesystem::path>(organs, "some/organ name/"));
}

TEST(DatasetPlan, HandsOutWholeClipsEvenly) {
  const DatasetPlan plan = plan_of(41, 3, 0.3);  // 11 clips: 4, 4 and 3
  EXPECT_EQ(plan.frames, 44);
  int clips[3] = {};
  std::set<std::string> folders;
  for (const DatasetShard& shard : plan.shards) {
    EXPECT_EQ(shard.first_clip, clips[shard.organ]);
    EXPECT_LE(shard.clips, 2);
    clips[shard.organ] += shard.clips;
    folders.insert(shard.folder);
  }
  EXPECT_EQ(clips[0], 4);
  EXPECT_EQ(clips[1], 4);
  EXPECT_EQ(clips[2], 3);
  EXPECT_EQ(folders.size(), plan.shards.size());
}

TEST(DatasetPlan, KeepsAnOrganOnOneSide) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const DatasetPlan plan = plan_of(400, 5, 0.4, seed);
    const auto tests = std::count_if(plan.organs.begin(), plan.organs.end(),
                                     [](const DatasetOrgan& organ) { return organ.test; });
    EXPECT_EQ(tests, 2);
    for (const DatasetShard& shard : plan.shards)
      EXPECT_EQ(shard.folder.starts_with("test/"), plan.organs[shard.organ].test);
  }
  const auto tests_of = [](std::size_t organs, double share) {
    const DatasetPlan plan = plan_of(100, organs, share);
    return std::count_if(plan.organs.begin(), plan.organs.end(),
                         [](const DatasetOrgan& organ) { return organ.test; });
  };
  EXPECT_EQ(tests_of(1, 0.5), 0);
  EXPECT_EQ(tests_of(2, 0.01), 1);
  EXPECT_EQ(tests_of(3, 1), 2);
  EXPECT_EQ(tests_of(3, 0), 0);
}

}  // namespace
}  // namespace organbake
