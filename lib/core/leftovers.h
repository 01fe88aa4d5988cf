// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace organbake {

// What is being written bears a temporary name: that of its target, this mark, and the number of
// the process that writes it.
inline constexpr std::string_view kTemporaryMark = ".tmp-";

// Removes from a folder what killed processes left under temporary names that begin with `prefix`,
// up to and with the mark.
void remove_leftovers(const std::filesystem::path& folder, const std::string& prefix);

}  // namespace organbake
