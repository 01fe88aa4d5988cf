// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace organbake {

// The number behind a word, as the files below /proc and /sys tell it: "MemTotal:  24683204 kB",
// "inactive_file 4096". Nothing where the file or the word is not there.
std::optional<double> number_behind(const std::string& word, const std::filesystem::path& file);

}  // namespace organbake
