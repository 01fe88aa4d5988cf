// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "core/run_context.h"
#include "dataset/dataset_plan.h"
#include "player/player.h"

namespace organbake {

// Plays a shard's clips and writes their pictures, truth and shard.json, its clips and what the
// card counts, into its folder, which then appears as a whole.
void make_shard(const DatasetSpec& spec, const DatasetShard& shard, Player& player,
                const std::filesystem::path& dataset, const RunContext& context);

}  // namespace organbake
