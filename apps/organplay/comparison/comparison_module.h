// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "organbake/core/run_context.h"
#include "organbake/evaluation/comparison_table.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/player/player.h"

namespace organbake {

struct ComparisonTexts {
  std::string json, text;
};

}  // namespace organbake

// The door of the module: compare_with_truth(), and what it found in both forms.
extern "C" __attribute__((visibility("default"))) void organplay_compare(
    organbake::Player& player, const organbake::TriangleMesh& surface,
    const organbake::CompareOptions& options, const organbake::RunContext& context,
    organbake::ComparisonTexts& found);
