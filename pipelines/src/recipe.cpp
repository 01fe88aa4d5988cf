// SPDX-License-Identifier: GPL-3.0-or-later
// Reads recipes (YAML) and what --set adds, checks them, and refuses what is none.
#include "organbake/pipelines/recipe.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/pipelines/batch_run.h"
#include "organbake/pipelines/documents.h"
#include "organbake/pipelines/options_json.h"
#include "recipe_inputs.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

// Who gives an organ in the place of a recipe is told what to write. Throws UsageError when the
// file or folder is there and is, by its name or its first bytes, a scan, a surface, frames, a
// table of cases or a bundle.
void check_is_no_input(const fs::path& file) {
  const std::string name = file.string();
  if (!fs::exists(file)) return;
  if (fs::exists(file / "manifest.json"))
    throw UsageError(name + " is a bundle, baked already; 'organplay' shows it");
  const std::string ending = lower_ending(file);
  if (ending == ".csv" || ending == ".tsv")
    throw UsageError(name + " is a table of cases, not a recipe; write: organbake batch " +
                     shell_word(name) + " --recipe liver -o FOLDER");
  const GivenInput given = given_input(file);
  if (given.input.empty()) return;
  throw UsageError(name + " is " + given.what + ", not a recipe; write: organbake bake " +
                   (given.input == "frames" ? "laparoscopy" : "liver") + " --set " +
                   shell_word(given.input + "=" + name) + " -o BUNDLE");
}

using Json = nlohmann::json;

constexpr const char* kRecipeSchema = "organbake/recipe/1";
constexpr std::size_t kMostRecipeBytes = std::size_t{1} << 20;

// Every section's options at their defaults: one list per stage, and the bundle's own.
std::map<std::string, StageOptions> default_options(BundleOptions& bundle) {
  std::map<std::string, StageOptions> sections;
  for (const Stage& stage : all_stages()) sections[stage.name] = stage.make_options();
  bind(sections["bundle"].list, bundle);
  return sections;
}

// One "--set key=value", taken apart.
struct Setting {
  std::string section, key, value, origin;  // no section: an input, or the recipe's name
};

Setting parse_setting(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw RecipeError("--set " + text + ": it takes key=value, such as decimate.faces=100");
  }
  const std::string key = text.substr(0, equals);
  const std::size_t dot = key.find('.');
  const bool sectioned = dot != std::string::npos;
  return {sectioned ? key.substr(0, dot) : "", sectioned ? key.substr(dot + 1) : key,
          text.substr(equals + 1), "--set " + text};
}

// What is wrong with an option's value is wrong with the recipe.
template <class Work>
auto as_recipe_error(const Work& work) {
  try {
    return work();
  } catch (const UsageError& error) {
    throw RecipeError(error.what());
  }
}

bool is_input(const std::string& key) {
  return key == "label" || is_input_frame_key(key) || is_recipe_input(key);
}

// Texts are paths, but for what has a kind of its own.
Json input_value(const Setting& setting) {
  if (setting.key == "label") return plain_scalar(setting.value);
  if (!is_input_frame_key(setting.key)) return setting.value;
  return as_recipe_error(
      [&] { return to_json(parse_input_frame(setting.key, setting.value, setting.origin)); });
}

// Keys come from a command line: "/" and "~" mean something else in a JSON pointer.
std::string pointer_to(const std::string& section, const std::string& key) {
  return (Json::json_pointer() / section / key).to_string();
}

// `notes` gets what is to be said of a setting that there was once.
void apply_option(Document& document, const OptionList* options, const Setting& setting,
                  std::vector<std::string>& notes) {
  const std::string retired = options ? options->retired_note(setting.key) : "";
  if (!retired.empty()) return notes.push_back(setting.section + "." + retired);
  const Option* option = options ? options->find(setting.key) : nullptr;
  if (!option) {  // left to the schema check, which knows the nearest key
    document.set(pointer_to(setting.section, setting.key), setting.value, setting.origin);
    return;
  }
  const OptionValue value =
      as_recipe_error([&] { return parse_option(*option, setting.value, setting.origin); });
  document.set(pointer_to(setting.section, option->name), to_json(value), setting.origin);
}

void apply_input(Document& document, const std::map<std::string, StageOptions>& sections,
                 const Setting& setting) {
  for (const auto& [name, section] : sections) {
    if (!is_input(setting.key) && section.list.find(setting.key)) {
      throw RecipeError(setting.origin + ": '" + setting.key + "' belongs to a section; say " +
                        name + "." + setting.key);
    }
  }
  if (!is_input(setting.key)) {
    std::vector<std::string> known = {"name", "quality", "label"};
    for (const RecipeInput& input : recipe_inputs()) known.push_back(input.name);
    for (const std::string& key : input_frame_keys()) known.push_back(key);
    throw RecipeError(setting.origin + ": unknown key 'inputs." + setting.key + "'" +
                      suggestion(setting.key, known));
  }
  const std::string pointer = pointer_to("inputs", setting.key);
  if (!setting.value.empty()) return document.set(pointer, input_value(setting), setting.origin);
  if (!document.json().contains(Json::json_pointer(pointer)))  // a variable of a shell, say
    throw RecipeError(setting.origin + ": the value is empty, and the recipe has no " +
                      setting.key + " to take away");
  document.remove(pointer);
}

void apply(Document& document, const std::map<std::string, StageOptions>& sections,
           const Setting& setting, std::vector<std::string>& notes) {
  if (setting.section.empty() && (setting.key == "name" || setting.key == "quality")) {
    document.set("/" + setting.key, setting.value, setting.origin);
  } else if (setting.section.empty()) {
    apply_input(document, sections, setting);
  } else {
    const auto found = sections.find(setting.section);
    apply_option(document, found == sections.end() ? nullptr : &found->second.list, setting, notes);
  }
}

Json section_of(const Json& json, const std::string& name) {
  const auto found = json.find(name);
  return found == json.end() ? Json::object() : *found;
}

// Takes out settings that there were once; returns what to say of them.
std::vector<std::string> drop_retired(Document& document,
                                      const std::map<std::string, StageOptions>& sections) {
  std::vector<std::string> notes;
  for (const auto& [name, section] : sections) {
    const Json given = section_of(document.json(), name);
    if (!given.is_object()) continue;
    for (const auto& [key, value] : given.items()) {
      const std::string retired = section.list.retired_note(key);
      if (retired.empty()) continue;
      document.remove(pointer_to(name, key));
      notes.push_back(name + "." + retired);
    }
  }
  return notes;
}

// A section that is there but empty ("mechanics:") means: with the defaults.
Document read_document(const fs::path& file, const std::map<std::string, StageOptions>& sections) {
  Document document = Document::parse_yaml(read_text_file(file, kMostRecipeBytes), file.string());
  if (!document.json().is_object()) {
    throw RecipeError(file.string() + ": is not a recipe; its first line should be 'schema: " +
                      kRecipeSchema + "'");
  }
  for (const auto& [name, ignored] : sections) {
    if (document.json().contains(name) && document.json()[name].is_null()) {
      document.set("/" + name, Json::object(), document.location("/" + name));
    }
  }
  return document;
}

// Comes before the recipe's own options, which then outrank it.
void apply_quality(Recipe& recipe, const std::map<std::string, StageOptions>& sections,
                   const Json& json) {
  if (recipe.quality.empty()) return;
  for (const auto& [section, key, value] : quality_options(recipe.quality)) {
    const std::string name = section + "." + key;
    const Option* option = sections.at(section).list.find(key);
    option->set(parse_option(*option, value, "quality " + recipe.quality + ": " + name));
    const Json own = section_of(json, section);
    if (own.contains(key)) recipe.outranked.push_back({name, own[key].dump()});
  }
}

// What stands for the same in two stages is said once.
void take_from_others(const std::map<std::string, StageOptions>& sections, const Json& json) {
  for (const auto& [name, section] : sections)
    for (const Option& option : section.list.all()) {
      const std::string& as = option.traits.as;
      if (as.empty() || section_of(json, name).contains(option.name)) continue;
      const std::size_t dot = as.find('.');
      option.set(sections.at(as.substr(0, dot)).list.find(as.substr(dot + 1))->get());
    }
}

// Bytes that are no UTF-8 could not be written into any of the documents that follow.
void check_text(const Document& document) {
  try {
    document.json().dump();
  } catch (const Json::exception&) {
    throw RecipeError(document.name() + ": holds bytes that are no UTF-8 text");
  }
}

}  // namespace

const std::vector<RecipeInput>& recipe_inputs() {
  static const std::vector<RecipeInput> inputs = {
      {"ct", InputKind::volume, "CT: a file or a folder of DICOM slices"},
      {"mask", InputKind::volume, "label mask; the organ is one label of it"},
      {"label_names", InputKind::file,
       "names of the mask's labels, as ITK-SNAP, 3D Slicer or nnU-Net writes them"},
      {"photos", InputKind::photos, "posed photographs: a cameras.json with images"},
      {"lighting", InputKind::file, "the light that the colours were taken in (JSON)"},
      {"exemplar", InputKind::file, "photograph of the tissue that a surface without colours gets"},
      {"exemplar_mask", InputKind::file,
       "picture of the exemplar's size, black where it is another tissue"},
      {"frames", InputKind::frames, "laparoscopy: a frame, a folder of frames, or a video"},
      {"intrinsics", InputKind::cameras, "of the laparoscope: a cameras.json of one camera"},
      {"poses", InputKind::posed,
       "of a laparoscopy's frames: their cameras as another program found them"},
      {"left", InputKind::frames, "stereo laparoscopy: the left eye's frames, or both eyes'"},
      {"right", InputKind::frames, "of a stereo laparoscopy: the right eye's frames"},
      {"calibration", InputKind::lenses, "of a stereo laparoscopy: how its eyes stand"},
      {"unposed", InputKind::photos,
       "photographs whose poses register shall find: a cameras.json with images and lenses"},
      {"surface", InputKind::mesh, "the organ's surface, when there is one already"},
      {"mesh", InputKind::mesh, "a surface that repair makes fit first"}};
  return inputs;
}

bool is_recipe_input(const std::string& name) {
  const auto& inputs = recipe_inputs();
  return std::any_of(inputs.begin(), inputs.end(),
                     [&](const RecipeInput& input) { return input.name == name; });
}

Json recipe_schema() {
  BundleOptions bundle;
  Json inputs = Json::object();
  for (const RecipeInput& input : recipe_inputs())
    inputs[input.name] = {{"type", "string"}, {"description", input.help}};
  inputs["label"] = {
      {"anyOf",
       {{{"type", "integer"}, {"minimum", 1}, {"maximum", 1 << 24}}, {{"type", "string"}}}},
      {"description",
       "the organ's label in the mask, number or name; the same as isosurface.label"}};
  for (const std::string& key : input_frame_keys()) inputs[key] = input_frame_schema(key);
  Json properties = {
      {"schema", {{"type", "string"}, {"enum", {kRecipeSchema}}}},
      {"name", {{"type", "string"}, {"description", "what the bundle is called"}}},
      {"quality",
       {{"type", "string"},
        {"enum", quality_names()},
        {"description", "sets the options that trade time for error where this recipe does not"}}},
      {"inputs", {{"type", "object"}, {"additionalProperties", false}, {"properties", inputs}}}};
  for (const auto& [name, section] : default_options(bundle)) {
    properties[name] = options_schema(section.list);
    const Stage* stage = find_stage(name);
    properties[name]["description"] = stage ? stage->summary : "what the bundle holds besides";
  }
  return {{"$schema", "http://json-schema.org/draft-07/schema#"},
          {"$id", kRecipeSchema},
          {"title", "organbake recipe"},
          {"type", "object"},
          {"required", {"schema"}},
          {"additionalProperties", false},
          {"properties", properties}};
}

Recipe read_recipe(const fs::path& file, const std::vector<std::string>& settings) {
  check_is_no_input(file);
  Recipe recipe;
  std::map<std::string, StageOptions> sections = default_options(recipe.bundle);
  Document document = read_document(file, sections);
  check_text(document);
  recipe.notes = drop_retired(document, sections);
  std::set<std::string> set_by_user;
  for (const std::string& text : settings) {
    const Setting setting = parse_setting(text);
    apply(document, sections, setting, recipe.notes);
    if (setting.section.empty()) set_by_user.insert(setting.key);
  }
  check_text(document);
  if (const auto error = schema_error(document, recipe_schema())) throw RecipeError(*error);

  const Json& json = document.json();
  recipe.name = json.value("name", file.stem().string());
  recipe.quality = json.value("quality", "");
  apply_quality(recipe, sections, json);
  for (auto& [name, section] : sections) {
    set_from_json(section.list, section_of(json, name), name + ".");
    if (json.contains(name)) recipe.sections.insert(name);
  }
  take_from_others(sections, json);
  apply_input_frame(document, sections);
  const Json inputs = section_of(json, "inputs");
  for (const std::string& key : input_frame_keys())
    if (inputs.value(key, "auto") != "auto") recipe.said_of_inputs.push_back(key);
  if (inputs.contains("label")) {
    if (!inputs.contains("mask")) {
      throw RecipeError(file.string() + ": label is " + inputs["label"].dump() +
                        ", but there is no mask that has it; give mask=FILE, or leave label out");
    }
    set_from_json(sections["isosurface"].list, {{"label", inputs["label"]}}, "inputs.");
  }
  if (section_of(json, "isosurface").value("each_label", false)) {
    throw RecipeError(file.string() +
                      ": isosurface.each_label is for the command alone: a bake "
                      "takes one organ; batch bakes many");
  }
  for (const RecipeInput& input : recipe_inputs()) {
    if (!inputs.contains(input.name)) continue;
    const fs::path path = inputs[input.name].get<std::string>();
    const bool as_it_is = path.is_absolute() || set_by_user.contains(input.name);
    recipe.inputs[input.name] = as_it_is ? path : file.parent_path() / path;
  }
  // A surface that is to be repaired is what repair takes; other surfaces are sound already.
  if (recipe.sections.contains("repair")) {
    if (const auto surface = recipe.inputs.extract("surface"); !surface.empty()) {
      recipe.inputs["mesh"] = surface.mapped();
    }
    if (!recipe.inputs.contains("mesh")) recipe.sections.erase("repair");
  }
  sections.erase("bundle");
  recipe.options = std::move(sections);
  return recipe;
}

void bind(OptionList& list, BundleOptions& o) {
  list.add("surface", &o.surface,
           {.help = "keep the coloured surface in the bundle, to compare frames with"});
}

}  // namespace organbake
