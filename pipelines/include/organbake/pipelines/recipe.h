// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <set>
#include <string>
#include <vector>

#include "organbake/options/options.h"
#include "organbake/pipelines/stage.h"

namespace organbake {

// What a user brings to a bake. Everything else is made by a stage.
struct RecipeInput {
  std::string name;
  InputKind kind;
  std::string help;
};
const std::vector<RecipeInput>& recipe_inputs();
bool is_recipe_input(const std::string& name);

// A recipe's section `bundle`.
struct BundleOptions {
  bool surface = false;
};
void bind(OptionList& list, BundleOptions& options);

// A recipe, checked and with every option resolved.
struct Recipe {
  // An option of the quality that the recipe says otherwise.
  struct Outranked {
    std::string option, value;  // "place.size_px", and what the recipe says
  };

  std::string name;
  std::string quality;               // one of quality_names(); empty: none is asked for
  std::vector<Outranked> outranked;  // of the quality's options
  std::map<std::string, std::filesystem::path> inputs;  // those that are given
  std::vector<std::string> said_of_inputs;              // "unit", "space"
  std::map<std::string, StageOptions> options;          // of every stage there is
  std::set<std::string> sections;                       // stages that the recipe mentions
  std::vector<std::string> notes;                       // what is said of settings that are gone
  std::map<std::string, std::string> declined;          // stages that made nothing of it, and why
  BundleOptions bundle;
};

// Reads a recipe (YAML) and applies "key=value" settings: an input ("ct=scan.nii.gz"; empty takes
// it away), what it is in ("unit=cm", "space=RAS"), "quality=draft", or a section's option
// ("decimate.faces=100"). An option that neither names is the quality's, else its default. Paths in
// the file are relative to its folder, those of settings to the current one. Throws NoInputError,
// UsageError for an input in the place of a recipe (forgotten_recipe.h), or RecipeError that names
// the line and key, and the nearest known key.
Recipe read_recipe(const std::filesystem::path& file, const std::vector<std::string>& settings);

// Generated from the stages' option lists.
nlohmann::json recipe_schema();

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

// A whole bake's options by one word. `standard` is what the stages do by themselves; `draft` and
// `fine` stand where a sweep of their options found nothing that is both faster and more accurate.
// What a recipe or --set says outranks them.
const std::vector<std::string>& quality_names();  // draft, standard, fine

struct QualityOption {
  std::string section, key, value;  // value as a command line gives it
};
// Throws std::out_of_range for another name.
std::vector<QualityOption> quality_options(const std::string& name);

}  // namespace organbake
