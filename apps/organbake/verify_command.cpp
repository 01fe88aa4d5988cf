// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "organbake/bundle/bundle_reader.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/dataset/dataset.h"
#include "organbake/pipelines/bake_report.h"
#include "organbake/pipelines/bake_warnings.h"
#include "organbake/pipelines/recipe.h"
#include "organbake/pipelines/schemas.h"
#include "organbake/truth/lens_picture.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

using Warnings = std::vector<std::string>;

bool is_empty(const CameraMaps& maps) {
  return std::all_of(maps.face.begin(), maps.face.end(),
                     [](std::uint32_t face) { return face == kNoFace; });
}

// Whole files may still show nothing. Throws BadDataError when no camera does.
void check_maps(const BundleReader& reader, Warnings& warnings) {
  const Bundle bundle = reader.read_all();
  std::string empty;
  std::size_t count = 0;
  for (std::size_t c = 0; c < bundle.maps.size(); ++c) {
    if (!is_empty(bundle.maps[c])) continue;
    empty += (count++ ? ", " : "") + camera_folder(c);
  }
  if (count == bundle.maps.size())
    throw BadDataError(reader.folder(),
                       "the maps of all its cameras are empty, so it shows nothing; check that the "
                       "surface faces outward and is where the cameras look, and bake it anew");
  if (count > 0) warnings.push_back("maps that show nothing of the organ: " + empty);
}

// The bundle's own check comes first: what it refuses has no business in a JSON parser.
std::string verify_bundle(const fs::path& folder, Warnings& warnings) {
  const BundleReader bundle(folder);
  bundle.verify();
  check_json_file(folder / "manifest.json", "bundle");
  check_json_file(folder / "cameras.json", "cameras");
  check_json_file(folder / "mechanics.json", "mechanics");
  if (bundle.has("report.json")) warnings = bake_warnings(read_bake_report(bundle));
  check_maps(bundle, warnings);
  return "bundle, " + std::to_string(bundle.manifest().files.size()) + " files";
}

// Beyond the schema: rotations are rotations, triangles name cameras that exist, ranges go upwards,
// shards hold a clip.
std::string verify_parsed(const Document& document) {
  const std::string schema = schema_of(document);
  check_document(document, schema);
  const std::string text = document.json().dump();
  if (schema == "cameras") cameras_from_json(text, document.name());
  if (schema == "dataset") dataset_spec_from_json(text, document.name());
  if (schema == "scope-lens") scope_lens_from_json(text, document.name());
  return schema;
}

bool is_dataset(const Document& document) {
  const nlohmann::json& json = document.json();
  return json.is_object() && json.contains("schema") && json["schema"].is_string() &&
         json["schema"].get<std::string>().starts_with("organbake/dataset/");
}

// A data set's spec, or else a recipe.
std::string verify_yaml(const fs::path& file) {
  const Document document = Document::parse_yaml(read_text_file(file), file.string());
  if (is_dataset(document)) return verify_parsed(document);
  read_recipe(file, {});
  return "recipe";
}

std::string verify_document(const fs::path& file) {
  const std::string text = read_text_file(file);
  // A document may have any name; what begins otherwise is something else.
  if (file.extension() != ".json" && first_letter(text) != '{') {
    throw UsageError(file.string() +
                     ": verify takes a bundle's folder, a JSON document, a recipe or a data set's "
                     "spec (.yaml)");
  }
  return verify_parsed(Document::parse_json(text, file.string()));
}

std::string verify(const fs::path& path, Warnings& warnings) {
  if (!fs::exists(path)) throw NoInputError(path, "there is no such file or folder");
  if (fs::is_directory(path)) return verify_bundle(path, warnings);
  if (path.filename() == "manifest.json") return verify_bundle(path.parent_path(), warnings);
  const std::string ending = path.extension().string();
  if (ending == ".yaml" || ending == ".yml") return verify_yaml(path);
  return verify_document(path);
}

}  // namespace

int run_verify(const Arguments& arguments, Session& session) {
  const auto words = session.read_command(
      arguments, "verify BUNDLE|DOCUMENT|RECIPE",
      "Checks every byte of a bundle against its manifest, every document against its schema, and "
      "that the maps show something. What the bake warned of is told again.",
      {}, 1);
  if (!words) return 0;
  if (words->empty()) throw UsageError("'organbake verify' needs a bundle or a document");
  Warnings warnings;
  const std::string what = verify(words->front(), warnings);
  for (const std::string& warning : warnings) session.terminal().log(LogLevel::warning, warning);
  session.print_result(
      words->front() + ": ok (" + what + ")",
      {{"path", words->front()}, {"ok", true}, {"what", what}, {"warnings", warnings}});
  return 0;
}

}  // namespace organbake
