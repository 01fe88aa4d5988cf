// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace organbake {

// A scan, a clip or a surface that lies in a folder.
struct FoundInput {
  std::string input;  // the recipe's: "ct" (a mask among them), "frames", "surface"
  std::filesystem::path path;
};

// Those in a folder and up to three folders below it, by path. A folder of DICOM slices or of
// frames is one of them; hidden files, bundles and what nobody bakes are passed over. Throws
// NoInputError where the folder is missing or holds none.
std::vector<FoundInput> inputs_in(const std::filesystem::path& folder);

}  // namespace organbake
