// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "organbake/pipelines/document.h"
#include "organbake/pipelines/stage.h"

namespace organbake {

// What a file or folder seems to be by its name and first bytes.
struct GivenInput {
  std::string what, input;  // "a surface", and the recipe's input that takes it; empty: none does
};

GivenInput given_input(const std::filesystem::path& path);
bool holds_frames(const std::filesystem::path& folder);

// What a recipe says of its inputs' coordinates, "unit" and "space": once, and for every stage that
// reads them. Stages that read meshes have options of these names.
const std::vector<std::string>& input_frame_keys();
bool is_input_frame_key(const std::string& key);
// Reads its value as a command line gives it (parse_option).
OptionValue parse_input_frame(const std::string& key, const std::string& text,
                              const std::string& where);
nlohmann::json input_frame_schema(const std::string& key);
bool reads_meshes(const OptionList& options);

// Gives what `inputs` says to all sections. Old recipes say it for single stages, which then holds
// for all. Throws RecipeError where two places say different things of the same input.
void apply_input_frame(const Document& recipe, std::map<std::string, StageOptions>& sections);

}  // namespace organbake
