// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace organbake {

// What is being written bears a temporary name: that of its target, this mark, and the number of
// the process that writes it.
inline constexpr std::string_view kTemporaryMark = ".tmp-";

// The temporary name under which this process is to write the file, beside it: ready to be renamed.
// Sweeps what killed processes left under the file's temporary names.
[[nodiscard]] std::filesystem::path temporary_file(const std::filesystem::path& file);

// Removes a file or a folder, as well as the system lets us: a fault that has passed at the second
// try leaves nothing behind.
void remove_all_of(const std::filesystem::path& path);

// Removes from a folder what killed processes left under temporary names that begin with `prefix`,
// up to and with the mark; under any, where none is given.
void remove_stale_temporaries(const std::filesystem::path& folder, const std::string& prefix);

}  // namespace organbake
