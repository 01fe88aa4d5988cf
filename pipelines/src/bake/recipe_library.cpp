// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/recipe_library.h"

#include <algorithm>
#include <sstream>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/nearest_name.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

// Of the recipes; empty when the program was moved away from them.
fs::path library_folder() {
  const fs::path bin = program_folder();
  for (const fs::path& folder :
       {bin / "../share/organbake/recipes", bin / "../../../pipelines/recipes"}) {
    if (fs::is_directory(folder)) return fs::weakly_canonical(folder);
  }
  return {};
}

// The first comment behind the licence, up to the end of its first sentence.
std::string first_sentence(const std::string& recipe) {
  std::istringstream lines(recipe);
  std::string sentence;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("# SPDX")) continue;
    if (!line.starts_with("# ")) break;
    sentence += (sentence.empty() ? "" : " ") + line.substr(2);
    const std::size_t end = sentence.find(". ");
    if (end != std::string::npos) return sentence.substr(0, end);
    if (sentence.back() == ':' || sentence.back() == '.')
      return sentence.substr(0, sentence.size() - 1);
  }
  return sentence;
}

}  // namespace

std::vector<KnownRecipe> known_recipes() {
  std::vector<KnownRecipe> recipes;
  const fs::path folder = library_folder();
  if (folder.empty()) return recipes;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const fs::path& file = entry.path();
    if (file.extension() == ".yaml")
      recipes.push_back({file.stem().string(), first_sentence(read_text_file(file)), file});
  }
  std::sort(recipes.begin(), recipes.end(),
            [](const KnownRecipe& a, const KnownRecipe& b) { return a.name < b.name; });
  return recipes;
}

std::vector<std::string> known_recipe_names() {
  std::vector<std::string> names;
  for (const KnownRecipe& recipe : known_recipes()) names.push_back(recipe.name);
  return names;
}

fs::path recipe_file(const std::string& word) {
  if (fs::is_regular_file(word)) return word;
  const std::string name = word.ends_with(".yaml") ? word.substr(0, word.size() - 5) : word;
  const fs::path known = library_folder() / (name + ".yaml");
  const bool is_name = !name.empty() && name.find('/') == std::string::npos;
  if (is_name && fs::exists(known)) return known;
  if (fs::exists(word)) return word;  // what it is instead is said by who reads it
  throw NoInputError(word, "is neither a file nor a recipe that organbake knows" +
                               suggestion(name, known_recipe_names()) +
                               " ('organbake recipes' lists them)");
}

}  // namespace organbake
