// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string_view>
#include <vector>

namespace organbake {

struct EmbeddedFile {
  std::string_view name;  // without a folder
  std::string_view text;
};

// The hand-written files of data-schemas/ and the scripts of pipelines/cluster/; the build turns
// them into this function's source, so that the program needs no data files beside it.
const std::vector<EmbeddedFile>& embedded_files();

}  // namespace organbake
