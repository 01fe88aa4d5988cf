// SPDX-License-Identifier: Apache-2.0
#include "comparison/comparison_module.h"

extern "C" void organplay_compare(organbake::Player& player, const organbake::TriangleMesh& surface,
                                  const organbake::CompareOptions& options,
                                  const organbake::RunContext& context,
                                  organbake::ComparisonTexts& found) {
  const organbake::ComparisonTable table =
      organbake::compare_with_truth(player, surface, options, context);
  found = {organbake::comparison_json(table), organbake::comparison_text(table)};
}
