// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

namespace organbake {

// The volume, and what a user asks for who has seen it: the last of its time points, and of that
// the middle.
void read_all_and_a_part(const std::filesystem::path& path);

// The mask, and its first two labels: by name where they have names, else by number.
void read_mask_and_labels(const std::filesystem::path& path);

}  // namespace organbake
