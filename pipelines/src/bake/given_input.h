// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

namespace organbake {

// What a file or folder seems to be by its name and first bytes.
struct GivenInput {
  std::string what, input;  // "a surface", and the recipe's input that takes it; empty: none does
};

GivenInput given_input(const std::filesystem::path& path);
bool holds_frames(const std::filesystem::path& folder);

}  // namespace organbake
