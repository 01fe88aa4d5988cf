// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/dataset/dataset_spec.h"

namespace organbake {

struct DatasetSummary {
  int frames = 0;
  int shards_made = 0, shards_kept = 0;  // kept: made by an earlier run
};

// Makes a data set of pokes and views of several organs, each on its own: a folder of train/ and
// test/ with shards of pictures and their truth (TruthRecorder), spec.json, card.json and the page
// index.html. A shard appears whole or not at all, so a run that was ended goes on where it was.
// The same bytes for a spec and its bundles, however often it was ended and on any number of
// threads. `generator`: the program and its version.
// Throws UsageError for a folder that holds another data set or anything else, and what playing
// and writing throw.
DatasetSummary make_dataset(const DatasetSpec& spec,
                            const std::vector<std::filesystem::path>& bundles,
                            const std::filesystem::path& folder, const std::string& generator,
                            const RunContext& context);

}  // namespace organbake
