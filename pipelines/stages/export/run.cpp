// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <optional>

#include "organbake/bundle/bundle_reader.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/deform/deformer.h"
#include "organbake/exchange/exchange.h"
#include "organbake/exchange/exports.h"
#include "organbake/formats/camera_files.h"
#include "organbake/image/png.h"
#include "organbake/pipelines/export_options.h"
#include "organbake/pipelines/stage.h"
#include "organbake/player/carried_surface.h"
#include "organbake/player/script.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

// Where the files of a set of pictures go, relative to the export's folder.
struct PictureFolders {
  const char* images = "images";
  const char* depths = "depth";
  const char* masks = nullptr;  // in COLMAP's way: the image's name and ".png" once more
};

// The pictures of all cameras with alpha, depth and masks. `set` then names the images.
SceneFacts write_pictures(const Bundle& bundle, const PictureFolders& folders,
                          const fs::path& folder, CameraSet& set, const RunContext& context) {
  const TriangleMesh base = base_surface(bundle);
  const RayScene scene(base);
  std::vector<CutOut> pictures;
  double largest_mm = 0;
  for (std::size_t c = 0; c < bundle.maps.size(); ++c) {
    context.throw_if_cancelled();
    context.progress(double(c) / double(bundle.maps.size()));
    pictures.push_back(cut_out(bundle.maps[c], bundle.cameras.cameras[c], base, scene));
    const auto& depths = pictures.back().depth_mm;
    largest_mm = std::max<double>(largest_mm, *std::max_element(depths.begin(), depths.end()));
  }
  SceneFacts facts{bounds(base), depth_unit_mm(largest_mm), {}, {}};
  set = bundle.cameras;
  set.images.clear();
  for (const char* name : {folders.images, folders.depths, folders.masks})
    if (name) make_folder(folder / name);
  for (std::size_t c = 0; c < pictures.size(); ++c) {
    const CutOut& picture = pictures[c];
    const std::string name = camera_folder(c) + ".png";
    set.images.push_back(name);
    facts.depths.push_back(std::string(folders.depths) + "/" + name);
    write_file_atomically(folder / folders.images / name, encode_png(picture.color, picture.alpha));
    write_file_atomically(folder / folders.depths / name, depth_png(picture, facts.depth_unit_mm));
    if (folders.masks)
      write_file_atomically(folder / folders.masks / (name + ".png"), mask_png(picture));
  }
  return facts;
}

// Points as close as the maps are fine, or as many as programs like to begin with.
std::vector<SparsePoint> points_of(const Bundle& bundle) {
  return surface_points(bundle, MapSampler(bundle).texel_mm());
}

void write_colmap(const Bundle& bundle, const fs::path& folder, const RunContext& context) {
  CameraSet set;
  SceneFacts facts = write_pictures(bundle, {.masks = "masks"}, folder, set, context);
  const std::vector<SparsePoint> points = points_of(bundle);
  const fs::path sparse = folder / "sparse" / "0";
  make_folder(sparse);
  write_file_atomically(sparse / "cameras.txt", colmap_cameras_text(set));
  write_file_atomically(sparse / "images.txt", colmap_images_text(set, points));
  write_file_atomically(sparse / "points3D.txt", colmap_points_text(points));
  facts.points = "sparse/0/points3D.txt";
  write_file_atomically(folder / "scene.json", scene_json(facts));
}

void write_transforms(const Bundle& bundle, const fs::path& folder, const RunContext& context) {
  CameraSet set;
  SceneFacts facts = write_pictures(bundle, {}, folder, set, context);
  for (std::string& image : set.images) image = "images/" + image;
  facts.points = "points.ply";
  write_file_atomically(folder / facts.points, point_cloud_ply(points_of(bundle)));
  write_file_atomically(folder / "transforms.json", transforms_json(set, facts));
}

TexturedMesh surface_of(const Bundle& bundle, const ExportOptions& options, int auto_side,
                        const RunContext& context) {
  const int side = options.texture ? static_cast<int>(*options.texture) : auto_side;
  TexturedMesh mesh = textured_surface(
      bundle, {.faces = options.faces, .texture_side = side, .albedo = options.albedo}, context);
  context.info(std::to_string(mesh.faces.size()) + " faces, a texture of " +
               std::to_string(mesh.color.width) + " × " + std::to_string(mesh.color.height) +
               " texels");
  return mesh;
}

void write_gltf(const Bundle& bundle, const ExportOptions& options, const fs::path& folder,
                const RunContext& context) {
  constexpr int kUsualSide = 2048;
  write_file_atomically(
      folder / "organ.glb",
      gltf_binary(surface_of(bundle, options, kUsualSide, context), bundle.cameras));
}

void write_obj(const Bundle& bundle, const ExportOptions& options, const fs::path& folder,
               const RunContext& context) {
  constexpr int kByDensity = 0;
  const TexturedMesh mesh = surface_of(bundle, options, kByDensity, context);
  write_file_atomically(folder / "organ.obj", obj_text(mesh, "organ.mtl"));
  write_file_atomically(folder / "organ.mtl",
                        obj_material_text(mesh, "organ.png", "organ_normal.png"));
  write_png(folder / "organ.png", mesh.color);
  write_png(folder / "organ_normal.png", mesh.normal_map);
}

// Where the player for pages lies: beside the installed program, or in the build's folders.
fs::path web_player_folder() {
  const fs::path around = program_folder().parent_path(), web = fs::path("share") / "organbake/web";
  const fs::path built = around.parent_path() / "web" / web;
  return fs::exists(around / web) || !fs::exists(built) ? around / web : built;
}

void write_web(const Bundle& bundle, const fs::path& folder, const RunContext& context) {
  const WebPlayer player = read_web_player(web_player_folder());
  write_file_atomically(folder / kWebPageFile, web_page(bundle, player, context));
}

// What blades cut has another mesh from then on, which no layer of USD holds; what another solver
// moved needs no solver here.
Script script_to_solve(const fs::path& file) {
  Script script = read_script(file);
  if (!script.vertices_mm.empty())
    throw UsageError(file.string() +
                     " says where the vertices are (\"vertices_mm\"), and the export moves them by "
                     "instruments alone; play it with organplay --script");
  for (const InstrumentPath& path : script.instruments) {
    if (has_blade(path.instrument.kind))
      throw UsageError(file.string() + " cuts, and a mesh in USD keeps its faces; leave out '" +
                       path.name + "'");
  }
  return script;
}

// Played without a picture.
UsdMotion recorded(const Bundle& bundle, const TexturedMesh& surface, const Script& script,
                   const RunContext& context) {
  DeformOptions options;
  options.time_step_s = script.time_step_s;
  options.solver = script.solver;
  const DeformBodies body = {
      {bundle.proxy, bundle.mechanics, bundle.base, bundle.skin ? &*bundle.skin : nullptr}};
  options = options.chosen_for(body);
  Deformer deformer(body, options);
  TriangleMesh plain;
  plain.vertices = surface.vertices;
  for (const auto& face : surface.faces)
    plain.faces.push_back({face[0].vertex, face[1].vertex, face[2].vertex});
  const CarriedSurface carried(std::move(plain), bundle.shell());
  const InstrumentMotion motion(script, bundle);
  UsdMotion record;
  record.frames_per_second = 1 / script.time_step_s;
  for (int frame = 0; frame < script.frames; ++frame) {
    context.throw_if_cancelled();
    deformer.step(motion.at(frame * script.time_step_s));
    record.vertices_mm.push_back(deformer.positions());
    if (options.solver == TissueSolver::fem) record.nodes_mm.push_back(deformer.node_positions(0));
    record.surface_mm.push_back(carried.carry(deformer.positions()));
  }
  return record;
}

void write_usd(const Bundle& bundle, const ExportOptions& options, const fs::path& folder,
               const RunContext& context) {
  constexpr int kUsualSide = 2048;
  std::optional<Script> script;
  if (!options.interaction.empty()) script = script_to_solve(options.interaction);
  const TexturedMesh mesh = surface_of(bundle, options, kUsualSide, context);
  UsdOptions usd{"organ.png", "organ_normal.png", options.vendor_names, {}};
  if (script) usd.motion = recorded(bundle, mesh, *script, context);
  write_file_atomically(folder / "organ.usda", usd_text(bundle, mesh, usd));
  write_png(folder / "organ.png", mesh.color);
  write_png(folder / "organ_normal.png", mesh.normal_map);
}

void write_sofa(const Bundle& bundle, const ExportOptions& options, const fs::path& folder,
                const RunContext& context) {
  write_obj(bundle, options, folder, context);
  write_file_atomically(folder / "organ.scn", sofa_text(bundle, "organ.obj", "organ.png"));
}

// Cells at the surface stick out of the organ, which a reader of the mesh alone does not see.
void tell_cells(const Bundle& bundle, const RunContext& context) {
  if (!bundle.mechanics.body) return;
  constexpr double kMm3PerMl = 1000;
  double whole_ml = 0, tissue_ml = 0;
  for (const Tetrahedron& t : bundle.mechanics.body->tetrahedra) {
    const double volume_ml = volume_of(*bundle.mechanics.body, t) / kMm3PerMl;
    whole_ml += volume_ml;
    tissue_ml += t.fill * volume_ml;
  }
  context.info("the tetrahedra enclose " + to_text(whole_ml, 1) + " ml, of which " +
               to_text(tissue_ml, 1) + " ml are tissue: those at the surface stick out of it");
}

// How large a model is that MuJoCo integrates explicitly, and how to get a coarser one: tetrahedra
// are made by a bake, so that node i stays the bundle's.
void write_mjcf(const Bundle& bundle, const StageCall& call, StageReport& report) {
  constexpr std::size_t kMany = 500;
  constexpr double kFewCells = 300;
  const MjcfModel model = mjcf_model(bundle);
  write_file_atomically(call.output_folder / "organ.xml", model.text);
  report.add("mjcf_bodies", model.bodies);
  report.add("mjcf_step_s", model.step_s);
  const std::string size = std::to_string(model.bodies) + " bodies and a step of " +
                           to_text(1e6 * model.step_s, 0) + " µs";
  if (model.bodies <= kMany) return call.context.info(size);
  double whole_mm3 = 0;
  for (const Tetrahedron& t : bundle.mechanics.body->tetrahedra)
    whole_mm3 += volume_of(*bundle.mechanics.body, t);
  call.context.warn(size +
                    ": MuJoCo loads so many for minutes; a bake with --set "
                    "mechanics.fem_cell_mm=" +
                    to_text(std::ceil(std::cbrt(whole_mm3 / kFewCells))) +
                    " makes a coarser model");
}

void write(const Bundle& bundle, const ExportOptions& options, const StageCall& call,
           StageReport& report) {
  const fs::path& folder = call.output_folder;
  const bool of_tetrahedra =
      options.format == ExportFormat::mjcf || options.format == ExportFormat::gmsh;
  if (of_tetrahedra) tell_cells(bundle, call.context);
  switch (options.format) {
    case ExportFormat::gltf:
      return write_gltf(bundle, options, folder, call.context);
    case ExportFormat::colmap:
      return write_colmap(bundle, folder, call.context);
    case ExportFormat::transforms:
      return write_transforms(bundle, folder, call.context);
    case ExportFormat::obj:
      return write_obj(bundle, options, folder, call.context);
    case ExportFormat::web:
      return write_web(bundle, folder, call.context);
    case ExportFormat::usd:
      return write_usd(bundle, options, folder, call.context);
    case ExportFormat::mjcf:
      return write_mjcf(bundle, call, report);
    case ExportFormat::gmsh:
      return write_file_atomically(folder / "organ.msh", gmsh_text(bundle));
    case ExportFormat::sofa:
      return write_sofa(bundle, options, folder, call.context);
  }
}

StageReport run(const StageCall& call) {
  const auto options = call.options_as<ExportOptions>();
  if (!options.interaction.empty() && options.format != ExportFormat::usd)
    throw UsageError("--interaction is of --format usd, which alone holds motion");
  StageReport report;
  write(BundleReader(*call.input("bundle")).read_all(), options, call, report);
  return report;
}

}  // namespace
}  // namespace organbake

ORGANBAKE_STAGE_MODULE(organbake::run)
