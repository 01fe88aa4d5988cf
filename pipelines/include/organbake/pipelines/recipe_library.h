// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace organbake {

// A recipe that comes with the program.
struct KnownRecipe {
  std::string name;     // "liver"
  std::string summary;  // the first sentence of its first comment
  std::filesystem::path file;
};

// Those in the folder beside this program, installed or built, by name.
std::vector<KnownRecipe> known_recipes();
std::vector<std::string> known_recipe_names();

// The file that a user means by a recipe's path or by the name of a known one ("liver", also
// "liver.yaml"). A file goes before a name, a name before a folder. Throws NoInputError with the
// nearest name for a word that is neither.
std::filesystem::path recipe_file(const std::string& word);

}  // namespace organbake
