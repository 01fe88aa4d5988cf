// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "organbake/bundle/bundle.h"
#include "organbake/bundle/bundle_reader.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/image/exr.h"
#include "organbake/pipelines/options_json.h"
#include "organbake/pipelines/recipe.h"
#include "organbake/pipelines/schemas.h"
#include "organbake/pipelines/stage_module.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

bool one_of(const std::string& text, std::initializer_list<const char*> choices) {
  return std::find(choices.begin(), choices.end(), text) != choices.end();
}

// Volumes and meshes need their readers' libraries, so a module looks at them.
StageReport inspect_in_module(const fs::path& path, const char* kind, const StageOptions& reading,
                              Session& session) {
  const RunContext context = session.context("inspect");
  const Stage stage{.name = "inspect"};
  context.progress(0);
  const StageReport report =
      run_in_module(stage, {reading.storage.get(), {}, {{kind, path}}, {}, context});
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
  if (fs::is_directory(path)) {
    return fs::exists(path / "manifest.json") ? inspect_bundle(path)
                                              : inspect_in_module(path, "volume", reading, session);
  }
  const std::string ending = lower_ending(path);
  if (ending == ".exr") return inspect_exr(path);
  if (ending == ".json") return inspect_document(path);
  if (one_of(ending, {".yaml", ".yml"})) return inspect_recipe(path);
  if (is_picture_name(path)) {
    throw UsageError(path.string() +
                     ": inspect takes a bundle, a volume, a mesh, an EXR map, a JSON document or a "
                     "recipe, no picture");
  }
  return inspect_in_module(path, is_mesh_name(path) ? "mesh" : "volume", reading, session);
}

int run_inspect(const Arguments& arguments, Session& session) {
  const StageOptions reading = inspect_options();
  const auto words = session.read_command(
      arguments, "inspect FILE|FOLDER [OPTIONS]",
      "Tells what a volume, DICOM folder, mesh, EXR image, bundle, document or recipe holds.",
      reading.list, 1);
  if (!words) return 0;
  if (words->empty()) throw UsageError("'organbake inspect' needs a file or folder");
  const StageReport report = inspect(words->front(), reading, session);
  nlohmann::json json = nlohmann::json::object();
  for (const auto& [name, value] : report.figures) json[name] = to_json(value);
  session.print_result(table(report), json);
  return 0;
}

}  // namespace organbake
