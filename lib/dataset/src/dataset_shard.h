// SPDX-License-Identifier: Apache-2.0
#pragma once

// What a data set is planned as, and how a shard of it is made.

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/core/run_context.h"
#include "organbake/dataset/dataset.h"
#include "organbake/image/channel_image.h"
#include "organbake/player/player.h"
#include "organbake/player/script.h"
#include "organbake/truth/lens_picture.h"

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

// A piece of a data set: what happens to which tissue, and how its pictures are exposed.
struct DatasetClip {
  Script script;
  double gain = 1, noise = 0, stiffness = 1;
};

// The clip of an organ, by both numbers and the spec's seed alone. Pokes come from directions in
// which the organ has skin; where none is found, a clip has fewer.
DatasetClip make_clip(const DatasetSpec& spec, const Bundle& bundle, std::size_t organ, int number);

// Plays a shard's clips and writes their pictures, truth and shard.json, its clips and what the
// card counts, into its folder, which then appears as a whole. lens: the spec's; null without one.
void make_shard(const DatasetSpec& spec, const std::shared_ptr<const LensPicture>& lens,
                const DatasetShard& shard, Player& player, const std::filesystem::path& dataset,
                const RunContext& context);

}  // namespace organbake
