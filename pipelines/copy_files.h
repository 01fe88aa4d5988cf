// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

namespace organbake {

// Makes the folders above a file. Throws IoError (writing).
void make_folder_of(const std::filesystem::path& file);

// Copies one file, making the folders above it. Never a hard link: a user may change a bundle's
// file, and the cache must not change with it. Throws IoError (writing).
void copy_into(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace organbake
