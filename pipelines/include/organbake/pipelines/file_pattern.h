// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace organbake {

// True for "scans/*.mha" unless a file is really called so. Shells expand patterns themselves, but
// not "**", and not more names than a command line holds.
bool is_file_pattern(const std::string& word);

// The folder that a pattern begins with: "a/b" of "a/b/*/c*.mp4", "." when there is none.
std::filesystem::path folder_of_pattern(const std::string& pattern);

// What a pattern names, in byte order: "*", "?" and "[…]" stay within one name and don't match a
// leading '.', "**" stands for any number of folders. Throws NoInputError when nothing matches,
// IoError when a folder can't be read.
std::vector<std::filesystem::path> files_matching(const std::string& pattern);

}  // namespace organbake
