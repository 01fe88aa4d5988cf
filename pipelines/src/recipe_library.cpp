// SPDX-License-Identifier: GPL-3.0-or-later
// What a recipe is made of: the recipes that come with organbake, their qualities, what a file
// given as input seems to be, and the unit and axes that hold for all inputs.
#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string_view>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/pipelines/cache.h"
#include "organbake/pipelines/options_json.h"
#include "organbake/pipelines/recipe.h"
#include "recipe_inputs.h"

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

namespace {

struct QualityRow {
  const char *section, *key;
  const char* values[3];  // draft, standard, fine
};

// Only what trades time for error whatever the scene: how many faces a proxy needs is the tissue's
// question, and what a surface's noise needs is the scanner's.
constexpr QualityRow kQualityRows[] = {
    {"decimate", "flips", {"false", "true", "true"}},
    {"place", "count", {"6", "8", "12"}},
    {"place", "size_px", {"256", "512", "1024"}},
    {"place", "size_limit_px", {"512", "2048", "2048"}},
    {"capture", "rays_per_texel_side", {"1", "0", "0"}},
    {"capture", "base_step_mm", {"4", "1.5", "1"}},
};

}  // namespace

const std::vector<std::string>& quality_names() {
  static const std::vector<std::string> names = {"draft", "standard", "fine"};
  return names;
}

std::vector<QualityOption> quality_options(const std::string& name) {
  const auto& names = quality_names();
  const auto column = std::size_t(std::find(names.begin(), names.end(), name) - names.begin());
  if (column == names.size()) throw std::out_of_range("no quality '" + name + "'");
  std::vector<QualityOption> options;
  for (const QualityRow& row : kQualityRows)
    options.push_back({row.section, row.key, row.values[column]});
  return options;
}

namespace {

template <std::size_t N>
bool is_one_of(const std::string& text, const std::array<std::string_view, N>& list) {
  return std::find(list.begin(), list.end(), text) != list.end();
}

bool is_volume_name(const fs::path& file) {
  constexpr std::array<std::string_view, 10> kEndings = {".nii", ".mha", ".mhd", ".nrrd", ".nhdr",
                                                         ".vti", ".dcm", ".ima", ".hdr",  ".img"};
  const std::string ending = lower_ending(file);
  const bool packed = ending == ".gz" || ending == ".bz2";
  return is_one_of(packed ? lower_ending(file.stem()) : ending, kEndings);
}

bool is_video_name(const fs::path& file) {
  constexpr std::array<std::string_view, 9> kEndings = {".mp4", ".m4v",  ".mkv", ".avi", ".mov",
                                                        ".wmv", ".webm", ".mpg", ".mpeg"};
  return is_one_of(lower_ending(file), kEndings);
}

}  // namespace

bool holds_frames(const fs::path& folder) {
  std::error_code ignored;
  const fs::directory_iterator files(folder, ignored);
  return std::any_of(begin(files), end(files),
                     [](const auto& entry) { return is_frame_name(entry.path()); });
}

GivenInput given_input(const fs::path& file) {
  if (fs::is_directory(file))
    return holds_frames(file) ? GivenInput{"a folder of frames", "frames"}
                              : GivenInput{"a folder", "ct"};
  if (is_mesh_name(file)) return {"a surface", "surface"};
  if (is_video_name(file)) return {"a video", "frames"};
  if (is_frame_name(file)) return {"a picture", "frames"};
  if (is_volume_name(file) || has_dicom_mark(file)) return {"a volume", "ct"};
  return {};
}

namespace {

using Json = nlohmann::json;

struct Said {
  std::string key;  // "inputs.unit"
  Json value;
  std::string where;
};

// "auto" says nothing.
std::optional<Said> said_in(const Document& recipe, const std::string& section,
                            const std::string& key) {
  const Json& json = recipe.json();
  if (!json.contains(section) || !json[section].is_object()) return std::nullopt;
  const Json value = json[section].value(key, Json());
  if (value.is_null() || value == "auto") return std::nullopt;
  return Said{section + "." + key, value, recipe.location("/" + section + "/" + key)};
}

void check_alike(const std::string& key, const Said& first, const Said& second) {
  if (first.value == second.value) return;
  throw RecipeError(second.where + ": " + second.key + " is " + second.value.dump() + ", but " +
                    first.key + " is " + first.value.dump() + "; the input has one " + key +
                    ", which holds for all stages: say it once, as " + key +
                    " under inputs (--set " + key + "=…)");
}

const OptionList& options_of_a_reader() {
  static const StageOptions options = [] {
    for (const Stage& stage : all_stages())
      if (StageOptions own = stage.make_options(); reads_meshes(own.list)) return own;
    return StageOptions();
  }();
  return options.list;
}

}  // namespace

const std::vector<std::string>& input_frame_keys() {
  static const std::vector<std::string> keys = {"unit", "space"};
  return keys;
}

bool is_input_frame_key(const std::string& key) {
  const auto& keys = input_frame_keys();
  return std::find(keys.begin(), keys.end(), key) != keys.end();
}

bool reads_meshes(const OptionList& options) { return options.find("space") != nullptr; }

OptionValue parse_input_frame(const std::string& key, const std::string& text,
                              const std::string& where) {
  return parse_option(*options_of_a_reader().find(key), text, where);
}

Json input_frame_schema(const std::string& key) {
  return options_schema(options_of_a_reader())["properties"][key];
}

void apply_input_frame(const Document& recipe, std::map<std::string, StageOptions>& sections) {
  for (const std::string& key : input_frame_keys()) {
    const std::optional<Said> of_inputs = said_in(recipe, "inputs", key);
    std::optional<Said> of_meshes = of_inputs;
    for (const auto& [name, section] : sections) {
      if (!reads_meshes(section.list)) continue;
      const std::optional<Said> own = said_in(recipe, name, key);
      if (own && of_meshes) check_alike(key, *of_meshes, *own);
      if (own) of_meshes = own;
    }
    for (auto& [name, section] : sections) {
      // The lengths of a calibration, say, may have a unit of their own.
      const bool mesh = reads_meshes(section.list);
      const std::optional<Said>& said = mesh ? of_meshes : of_inputs;
      if (!said || !section.list.find(key) || (!mesh && said_in(recipe, name, key))) continue;
      set_from_json(section.list, {{key, said->value}}, "inputs.");
    }
  }
}

}  // namespace organbake
