// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "organbake/bundle/breath.h"
#include "organbake/bundle/cameras_json.h"
#include "organbake/bundle/skin_image.h"
#include "organbake/bundle/stored_maps.h"
#include "organbake/capture/capture.h"
#include "organbake/capture/surface_color.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/parallel.h"
#include "organbake/core/text.h"
#include "organbake/formats/mesh_files.h"
#include "organbake/formats/photo.h"
#include "organbake/geometry/ply.h"
#include "organbake/image/srgb.h"
#include "organbake/pipelines/processes.h"
#include "organbake/pipelines/stage.h"
#include "stages/capture/options.h"

namespace organbake {
namespace {

// Photographs when there are any, else the surface's own vertex colours, else the exemplar's
// tissue, else the material, with the light that they show when it is known: `lighting`, but a
// material's is its own. What was passed over is told in the report, and so is the choice.
struct SurfaceColoring {
  std::unique_ptr<SurfaceColor> color;
  std::optional<Lighting> lighting;
};

SurfaceColoring choose_coloring(const TracedSurface& surface, std::vector<Photo> photos,
                                const std::optional<ExemplarPhoto>& exemplar,
                                const Material& material, const std::optional<Lighting>& lighting,
                                StageReport& report) {
  report.add("photos", photos.size());
  if (!photos.empty()) {
    report.add("color", "photos");
    report.skipped.push_back({"the material", "there are photographs"});
    if (exemplar) report.skipped.push_back({"the exemplar", "there are photographs"});
    return {make_photo_color(surface, std::move(photos)), lighting};
  }
  report.skipped.push_back({"colour from photographs", "none are given"});
  if (!surface.mesh.colors.empty()) {
    report.add("color", "vertices");
    report.skipped.push_back({"the material", "the surface has colours of its own"});
    if (exemplar) report.skipped.push_back({"the exemplar", "the surface has colours of its own"});
    return {make_vertex_color(surface.mesh), lighting};
  }
  report.skipped.push_back({"colour from vertices", "the surface has none"});
  if (lighting) report.skipped.push_back({"the lighting", "a material brings its own"});
  if (exemplar) {
    ExemplarLook look = make_exemplar_color(*exemplar, material);
    report.add("color", "exemplar");
    return {std::move(look.color), look.lighting};
  }
  report.add("color", "material");
  return {make_material_color(material), material.lighting()};
}

namespace fs = std::filesystem;

std::vector<Photo> read_photos(const StageCall& call) {
  const auto* document = call.input("photos");
  if (!document) document = call.input("scope_photo");
  if (!document) return {};
  const CameraSet set = read_cameras(*document);
  std::vector<Photo> photos(set.images.size());
  parallel_for(std::size_t{0}, photos.size(), [&](std::size_t i) {
    photos[i] = {set.cameras[i], read_photo(document->parent_path() / set.images[i])};
  });
  return photos;
}

// Said before the work, which may take minutes: whether the maps fit.
void check_memory(const std::vector<PosedCamera>& cameras, const RunContext& context) {
  constexpr double kBytesPerTexel = 48;  // 28 of the maps, the rest while they are packed
  constexpr double kMb = 1024 * 1024, kWorthSaying_mb = 1024;  // as machine_memory() counts
  double texels = 0;
  for (const PosedCamera& camera : cameras)
    texels += double(camera.intrinsics.width) * camera.intrinsics.height;
  const double needed_mb = texels * kBytesPerTexel / kMb;
  const double available_mb = machine_memory().available_mb;
  const std::string need = "the maps of " + std::to_string(cameras.size()) +
                           " cameras take about " + to_text(needed_mb / 1024, 1) + " GiB of memory";
  if (needed_mb > available_mb)
    throw UsageError(
        need + ", this machine has " + to_text(available_mb / 1024, 1) +
        " GiB free; place fewer cameras (place.count), or smaller maps (place.size_px)");
  if (needed_mb > kWorthSaying_mb) context.info(need);
}

// What the maps are bound to, written beside them where it is a smooth skin.
ShellSurface make_shell(const StageCall& call, const TracedSurface& surface,
                        const TriangleMesh& proxy, double edge_mm, StageReport& report) {
  if (edge_mm == 0) {
    report.skipped.push_back({"the smooth skin", "skin_edge = 0 asks for none"});
    return ShellSurface(proxy);
  }
  SmoothSkin skin = bake_smooth_skin(surface, proxy, edge_mm, call.context);
  write_exr(call.output_folder / kSkinFile, skin_to_image(skin), {});
  ShellSurface shell(proxy, std::move(skin));
  report.add("skin_faces", shell.at_rest().faces.size());
  report.add("skin_edge_mm", mean_edge_length(shell.at_rest()));
  return shell;
}

std::optional<Lighting> read_lighting(const StageCall& call) {
  const auto* document = call.input("lighting");
  if (!document) return std::nullopt;
  return lighting_from_json(read_text_file(*document), document->string());
}

// The proxy's motion while the tissue breathes, to be played.
void write_breath(const fs::path& folder, const fs::path& document, const TriangleMesh& proxy,
                  StageReport& report) {
  const Breath breath = breath_from_json(read_text_file(document), document.string());
  write_file_atomically(folder / kBreathFile, breath_script(breath, proxy.vertices));
  double most_mm = 0;
  for (const auto& vertex : proxy.vertices) most_mm = std::max(most_mm, breath.push(vertex).norm());
  report.add("breath_mm", most_mm);
}

std::optional<ExemplarPhoto> read_exemplar(const StageCall& call, double mm_per_pixel) {
  const auto* frame = call.input("exemplar");
  const auto* mask = call.input("exemplar_mask");
  if (!frame && mask)
    throw UsageError("--exemplar-mask " + mask->string() + " has no --exemplar to be of");
  if (!frame && mm_per_pixel > 0)
    throw UsageError("--exemplar-mm-per-pixel " + to_text(mm_per_pixel) +
                     " has no --exemplar to be of");
  if (!frame) return std::nullopt;
  if (!(mm_per_pixel > 0))
    throw UsageError("--exemplar " + frame->string() +
                     " needs --exemplar-mm-per-pixel: the size of its pixels on the tissue");
  ExemplarPhoto photo{read_photo(*frame), {}, mm_per_pixel};
  if (!mask) return photo;
  const Rgb8Image shown = read_photo(*mask);
  if (shown.width != photo.image.width || shown.height != photo.image.height)
    throw BadDataError(*mask, "is " + std::to_string(shown.width) + " × " +
                                  std::to_string(shown.height) + " pixels, its exemplar " +
                                  std::to_string(photo.image.width) + " × " +
                                  std::to_string(photo.image.height));
  for (std::size_t i = 0; i < shown.pixels.size(); i += 3)
    photo.mask.push_back(std::max({shown.pixels[i], shown.pixels[i + 1], shown.pixels[i + 2]}) >
                         127);
  return photo;
}

// An organ takes one tissue; a whole frame shows several.
void warn_of_several_tissues(const StageCall& call, const ExemplarPhoto& photo) {
  const std::vector<ShownTissue> tissues = tissues_shown(photo);
  if (tissues.size() < 2) return;
  std::string shares;
  for (const ShownTissue& tissue : tissues) {
    shares += (shares.empty() ? "" : ", ") + percent(tissue.share) + " of about sRGB";
    for (const float c : tissue.color) shares += " " + std::to_string(srgb8_from_linear(c));
  }
  call.context.warn(call.input("exemplar")->filename().string() +
                    " shows tissues of different hues, which will be mixed: " + shares +
                    ". Mask all but one (--exemplar-mask, exemplar_mask in a recipe)");
}

StageReport run(const StageCall& call) {
  const auto options = call.options_as<CaptureStageOptions>();
  options.capture.check();
  options.material.check();
  const std::optional<ExemplarPhoto> exemplar = read_exemplar(call, options.exemplar_mm_per_pixel);
  if (exemplar) warn_of_several_tissues(call, *exemplar);
  const TriangleMesh mesh = read_mesh(*call.input("surface"), options.frame, call.context);
  const TriangleMesh proxy = read_mesh(*call.input("proxy"), options.frame, call.context);
  const CameraSet set = read_cameras(*call.input("cameras"));
  check_memory(set.cameras, call.context);
  StageReport report;
  const TracedSurface surface(mesh);
  const auto [color, lighting] = choose_coloring(surface, read_photos(call), exemplar,
                                                 options.material, read_lighting(call), report);
  const ShellSurface shell = make_shell(call, surface, proxy, options.skin_edge_mm, report);
  const CaptureResult captured =
      capture(surface, shell.at_rest(), set.cameras, *color, options.capture, call.context);
  check_filled(captured, call.input("surface")->string());
  if (options.packing.compact) {
    report.skipped.push_back({"the compression", "compact chooses one for each kind of map"});
  }
  write_map_files(call.output_folder, captured.maps, set.cameras, captured.base, options.packing);
  write_ply(call.output_folder / "surface.ply",
            colored_surface(surface, *color, options.surface_edge_mm));
  if (lighting) {
    write_file_atomically(call.output_folder / kLightingFile, lighting_to_json(*lighting));
  } else {
    report.skipped.push_back({"lighting the pushed skin anew", "the light is not known"});
  }

  if (const fs::path* document = call.input("breath"))
    write_breath(call.output_folder, *document, proxy, report);

  report.add("cameras", captured.maps.size());
  report.add("bound_in_prism", captured.bound_in_prism);
  report.add("bound_by_fallback", captured.bound_by_fallback);
  report.add("unbound_texels", captured.unbound_texels);
  report.add("back_face_texels", captured.back_face_texels);
  report.add("unsure_texels", captured.unsure_texels);
  report.add("largest_height_mm", captured.largest_height_mm);
  return report;
}

}  // namespace
}  // namespace organbake

ORGANBAKE_STAGE_MODULE(organbake::run)
