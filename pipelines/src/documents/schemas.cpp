// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/schemas.h"

#include <nlohmann/json.hpp>

#include "documents/embedded_files.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/nearest_name.h"
#include "organbake/pipelines/recipe.h"
#include "organbake/pipelines/schema_check.h"

namespace organbake {
namespace {

constexpr const char* kRecipe = "recipe";  // made from the option lists, not written by hand
constexpr std::string_view kSchemaEnding = ".schema.json";

}  // namespace

std::vector<std::string> schema_names() {
  std::vector<std::string> names = {kRecipe};
  for (const EmbeddedFile& file : embedded_files()) {
    if (!file.name.ends_with(kSchemaEnding)) continue;
    names.emplace_back(file.name.substr(0, file.name.size() - kSchemaEnding.size()));
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::string schema_text(const std::string& name) {
  if (name == kRecipe) return recipe_schema().dump(2) + "\n";
  for (const EmbeddedFile& file : embedded_files()) {
    if (file.name == name + std::string(kSchemaEnding)) return std::string(file.text);
  }
  throw UsageError("there is no schema '" + name + "'" + suggestion(name, schema_names()) +
                   " ('organbake schema' lists them)");
}

std::string schema_of(const Document& document) {
  const nlohmann::json& json = document.json();
  const std::string id = json.is_object() && json.contains("schema") && json["schema"].is_string()
                             ? json["schema"].get<std::string>()
                             : "";
  for (const std::string& name : schema_names()) {
    if (id.starts_with("organbake/" + name + "/")) return name;
  }
  throw BadDataError(document.name(), id.empty() ? "has no key 'schema', so it is none of ours"
                                                 : "its schema '" + id + "' is not known");
}

void check_document(const Document& document, const std::string& schema_name) {
  const auto schema = nlohmann::json::parse(schema_text(schema_name));
  if (const auto error = schema_error(document, schema)) throw BadDataError(*error);
}

void check_json_file(const std::filesystem::path& file, const std::string& schema_name) {
  check_document(Document::parse_json(read_text_file(file), file.string()), schema_name);
}

}  // namespace organbake
