// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string_view>
#include <vector>

namespace organbake {

struct EmbeddedSchema {
  std::string_view name;
  std::string_view text;
};

// The hand-written files of data-schemas/; the build turns them into this function's source.
const std::vector<EmbeddedSchema>& embedded_schemas();

}  // namespace organbake
