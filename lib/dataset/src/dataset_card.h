// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "dataset_plan.h"

namespace organbake {

// What is in a finished data set, by its shards' own accounts: card.json and the page index.html.
void write_dataset_card(const DatasetSpec& spec, const DatasetPlan& plan,
                        const std::filesystem::path& folder, const std::string& generator);

}  // namespace organbake
