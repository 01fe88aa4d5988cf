// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace organbake {

struct ListedFolder {
  std::string name;
  bool is_bundle = false;
};

// The folders within one, bundles first, each kind by name; hidden ones are left out. Empty where
// the folder cannot be read.
std::vector<ListedFolder> list_folders(const std::filesystem::path& folder);

}  // namespace organbake
