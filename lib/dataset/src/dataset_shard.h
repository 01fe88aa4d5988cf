// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>

#include "dataset_plan.h"
#include "organbake/core/run_context.h"
#include "organbake/player/player.h"
#include "organbake/truth/lens_picture.h"

namespace organbake {

// Plays a shard's clips and writes their pictures, truth and shard.json, its clips and what the
// card counts, into its folder, which then appears as a whole. lens: the spec's; null without one.
void make_shard(const DatasetSpec& spec, const std::shared_ptr<const LensPicture>& lens,
                const DatasetShard& shard, Player& player, const std::filesystem::path& dataset,
                const RunContext& context);

}  // namespace organbake
