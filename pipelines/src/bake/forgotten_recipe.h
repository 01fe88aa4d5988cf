// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

namespace organbake {

// Who gives an organ in the place of a recipe is told what to write. Throws UsageError when the
// file or folder is there and is, by its name or its first bytes, a scan, a surface, frames, a
// table of cases or a bundle.
void check_is_no_input(const std::filesystem::path& file);

}  // namespace organbake
