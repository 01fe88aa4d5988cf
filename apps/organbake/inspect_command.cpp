// SPDX-License-Identifier: GPL-3.0-or-later
// organbake inspect, verify, reseal and schema: what a file holds, and whether it is sound.
#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "organbake/bundle/bundle.h"
#include "organbake/bundle/bundle_reader.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/image/exr.h"
#include "organbake/pipelines/bake_report.h"
#include "organbake/pipelines/documents.h"
#include "organbake/pipelines/options_json.h"
#include "organbake/pipelines/recipe.h"
#include "organbake/pipelines/stage.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

bool one_of(const std::string& text, std::initializer_list<const char*> choices) {
  return std::find(choices.begin(), choices.end(), text) != choices.end();
}

// What readers of their own libraries are for, a module looks at.
StageReport inspect_in_module(const fs::path& path, const std::string& kind, const void* asked,
                              const RunContext& context) {
  context.progress(0);
  const StageReport report =
      run_in_module(Stage{.name = "inspect"}, {asked, {}, {{kind, path}}, {}, context});
  context.progress(1);
  return report;
}

StageReport inspect_bundle(const fs::path& folder) {
  const BundleReader reader(folder);
  const Bundle bundle = reader.read_frame();
  std::uint64_t bytes = 0;
  for (const BundleFile& file : reader.manifest().files) bytes += file.bytes;
  StageReport report;
  report.add("kind", "bundle");
  report.add("name", reader.manifest().name);
  report.add("generator", reader.manifest().generator);
  report.add("files", reader.manifest().files.size());
  report.add("bytes", bytes);
  report.add("proxy_vertices", bundle.proxy.vertices.size());
  report.add("proxy_faces", bundle.proxy.faces.size());
  report.add("skin", bundle.skin ? "smooth, carried by the proxy" : "flat prisms over the proxy");
  if (bundle.skin) {
    const ShellSurface shell = bundle.shell();
    report.add("skin_faces", shell.at_rest().faces.size());
    report.add("skin_edge_mm", mean_edge_length(shell.at_rest()));
  }
  report.add("light", !bundle.lighting         ? "as baked; none is known"
                      : bundle.lighting->scope ? "at the scope"
                                               : "fixed in the world");
  report.add("springs", bundle.mechanics.springs.size());
  report.add("anchors", bundle.mechanics.anchors.size());
  report.add("cameras", bundle.cameras.cameras.size());
  const Intrinsics& map = bundle.cameras.cameras.front().intrinsics;
  report.add("map_size", std::vector<double>{double(map.width), double(map.height)});
  report.add("vpm_triangles", bundle.cameras.manifold.triangles.size());
  report.add("base_layer_steps", bundle.base.steps);
  report.add("has_surface", reader.has("surface.ply"));
  if (!reader.manifest().edited.empty()) report.add("edited_files", reader.manifest().edited);
  return report;
}

StageReport inspect_exr(const fs::path& file) {
  const ChannelImage image = read_exr(file);
  std::vector<std::string> channels;
  for (const Channel& channel : image.channels) channels.push_back(channel.name);
  StageReport report;
  report.add("kind", "image");
  report.add("width", image.width);
  report.add("height", image.height);
  report.add("channels", channels);
  return report;
}

StageReport inspect_recipe(const fs::path& file) {
  const Recipe recipe = read_recipe(file, {});
  StageReport report;
  report.add("kind", "recipe");
  report.add("name", recipe.name);
  if (!recipe.quality.empty()) report.add("quality", recipe.quality);
  for (const auto& [name, path] : recipe.inputs) report.add("input_" + name, path.string());
  report.add("sections", std::vector<std::string>(recipe.sections.begin(), recipe.sections.end()));
  return report;
}

StageReport inspect_document(const fs::path& file) {
  const Document document = Document::parse_json(read_text_file(file), file.string());
  StageReport report;
  report.add("kind", "document");
  report.add("schema", schema_of(document));
  for (const auto& [key, value] : document.json().items()) {
    if (value.is_array()) report.add(key, value.size());
  }
  return report;
}

std::string table(const StageReport& report) {
  constexpr std::size_t kColumn = 24;
  std::string text;
  for (const auto& [name, value] : report.figures) {
    if (!text.empty()) text += "\n";
    text +=
        name + std::string(kColumn - std::min(kColumn - 1, name.size()), ' ') + option_text(value);
  }
  return text;
}

}  // namespace

StageReport inspect(const fs::path& path, const StageOptions& reading, Session& session) {
  if (!fs::exists(path)) throw NoInputError(path, "there is no such file or folder");
  const auto in_module = [&](const char* kind) {
    return inspect_in_module(path, kind, reading.storage.get(), session.context("inspect"));
  };
  if (fs::is_directory(path))
    return fs::exists(path / "manifest.json") ? inspect_bundle(path) : in_module("volume");
  const std::string ending = lower_ending(path);
  if (ending == ".exr") return inspect_exr(path);
  if (ending == ".json") return inspect_document(path);
  if (one_of(ending, {".yaml", ".yml"})) return inspect_recipe(path);
  if (is_picture_name(path)) {
    throw UsageError(path.string() +
                     ": inspect takes a bundle, a volume, a mesh, an EXR map, a JSON document or a "
                     "recipe, no picture");
  }
  return in_module(is_mesh_name(path) ? "mesh" : "volume");
}

int run_inspect(const Arguments& arguments, Session& session) {
  const StageOptions reading = inspect_options();
  const auto words = session.read_command(
      arguments, "inspect FILE|FOLDER [OPTIONS]",
      "Tells what a volume, DICOM folder, mesh, EXR image, bundle, document or recipe holds.",
      reading.list, 1, "a file or folder");
  if (!words) return 0;
  const StageReport report = inspect(words->front(), reading, session);
  nlohmann::json json = nlohmann::json::object();
  for (const auto& [name, value] : report.figures) json[name] = to_json(value);
  session.print_result(table(report), json);
  return 0;
}

namespace {

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
std::string verify_parsed(const Document& document, const RunContext& context) {
  const std::string schema = schema_of(document);
  check_document(document, schema);
  const std::string text = document.json().dump();
  if (schema == "cameras") cameras_from_json(text, document.name());
  // What reads these belongs to the player, which the baker does without.
  if (one_of(schema, {"dataset", "scope-lens"}))
    inspect_in_module(document.name(), schema, &text, context);
  return schema;
}

bool is_dataset(const Document& document) {
  const nlohmann::json& json = document.json();
  return json.is_object() && json.contains("schema") && json["schema"].is_string() &&
         json["schema"].get<std::string>().starts_with("organbake/dataset/");
}

// A data set's spec, or else a recipe.
std::string verify_yaml(const fs::path& file, const RunContext& context) {
  const Document document = Document::parse_yaml(read_text_file(file), file.string());
  if (is_dataset(document)) return verify_parsed(document, context);
  read_recipe(file, {});
  return "recipe";
}

std::string verify_document(const fs::path& file, const RunContext& context) {
  const std::string text = read_text_file(file);
  // A document may have any name; what begins otherwise is something else.
  if (file.extension() != ".json" && first_letter(text) != '{') {
    throw UsageError(file.string() +
                     ": verify takes a bundle's folder, a JSON document, a recipe or a data set's "
                     "spec (.yaml)");
  }
  return verify_parsed(Document::parse_json(text, file.string()), context);
}

std::string verify(const fs::path& path, Warnings& warnings, const RunContext& context) {
  if (!fs::exists(path)) throw NoInputError(path, "there is no such file or folder");
  if (fs::is_directory(path)) return verify_bundle(path, warnings);
  if (path.filename() == "manifest.json") return verify_bundle(path.parent_path(), warnings);
  const std::string ending = path.extension().string();
  if (ending == ".yaml" || ending == ".yml") return verify_yaml(path, context);
  return verify_document(path, context);
}

}  // namespace

int run_verify(const Arguments& arguments, Session& session) {
  const auto words = session.read_command(
      arguments, "verify BUNDLE|DOCUMENT|RECIPE",
      "Checks every byte of a bundle against its manifest, every document against its schema, and "
      "that the maps show something. What the bake warned of is told again.",
      {}, 1, "a bundle or a document");
  if (!words) return 0;
  Warnings warnings;
  const std::string what = verify(words->front(), warnings, session.context("verify"));
  for (const std::string& warning : warnings) session.terminal().log(LogLevel::warning, warning);
  session.print_result(
      words->front() + ": ok (" + what + ")",
      {{"path", words->front()}, {"ok", true}, {"what", what}, {"warnings", warnings}});
  return 0;
}

int run_reseal(const Arguments& arguments, Session& session) {
  const auto words = session.read_command(
      arguments, "reseal BUNDLE",
      "Takes over images of a bundle that were edited by hand (cam_…/*.exr, base.exr; same size, "
      "same channels): after every check they get new checksums, and the manifest lists them.",
      {}, 1, "a bundle");
  if (!words) return 0;
  const std::filesystem::path folder = words->front();
  const ResealedBundle resealed = reseal(folder);
  // The one file that is written, and renamed into place: the bundle is the old or the new one.
  if (!resealed.changed.empty()) {
    write_file_atomically(folder / "manifest.json", manifest_to_json(resealed.manifest));
  }
  const std::string what = resealed.changed.empty() ? "ok, nothing was changed"
                                                    : "resealed " + joined(resealed.changed, ", ");
  session.print_result(words->front() + ": " + what,
                       {{"path", words->front()}, {"changed", resealed.changed}});
  return 0;
}

int run_schema(const Arguments& arguments, Session& session) {
  const auto words = session.read_command(
      arguments, "schema [NAME]",
      "Prints the JSON Schema of a kind of document, or lists the kinds there are.", {}, 1);
  if (!words) return 0;
  if (words->empty()) {
    session.print_result(joined(schema_names(), "\n"), schema_names());
  } else {
    write_to_stdout(schema_text(words->front()));
  }
  return 0;
}

}  // namespace organbake
