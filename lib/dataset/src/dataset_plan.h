// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "organbake/dataset/dataset_spec.h"

namespace organbake {

struct DatasetOrgan {
  std::filesystem::path bundle;
  std::string name;  // unlike the others'
  bool test = false;
};

// Clips of one organ that lie in one folder.
struct DatasetShard {
  std::size_t organ = 0;
  int first_clip = 0, clips = 0;  // of the organ
  std::string folder;             // "train/00_liver_0003"
  double begin = 0, end = 1;      // which part of the whole data set it is
};

struct DatasetPlan {
  std::vector<DatasetOrgan> organs;
  std::vector<DatasetShard> shards;  // by organ
  int frames = 0;                    // whole clips: at least as many as were asked for
};

// Who gets how many clips, and which organs are for tests: a share of them by the seed, at least
// one where there are two organs or more and the share is not 0, and never all.
DatasetPlan plan_dataset(const DatasetSpec& spec,
                         const std::vector<std::filesystem::path>& bundles);

}  // namespace organbake
