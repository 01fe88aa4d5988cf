// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "organbake/bundle/cameras_json.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/run_context.h"
#include "organbake/core/text.h"
#include "organbake/formats/camera_files.h"
#include "organbake/formats/mesh_files.h"
#include "organbake/formats/photo.h"
#include "organbake/fusion/fuse_views.h"
#include "organbake/geometry/camera.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/ply.h"
#include "organbake/geometry/rigid_transform.h"
#include "organbake/image/exr.h"
#include "organbake/pipelines/stage.h"
#include "stages/fuse/options.h"
#include "stages/shared/posed_depth.h"

namespace organbake {
namespace {

struct DepthViews {
  std::vector<DepthView> views;
  std::vector<std::string> without_pose;  // file names of maps that were left out
  std::string by_number;                  // MatchedPoses::by_number
};

namespace fs = std::filesystem;

std::vector<DepthFile> depth_files(const StageCall& call) {
  std::vector<DepthFile> files;
  for (const auto& [name, path] : call.inputs_of("depth")) {
    if (!fs::is_directory(path)) {
      files.push_back({path, {}, {}});
      continue;
    }
    for (DepthFile& file : depth_files_in(path)) files.push_back(std::move(file));
  }
  return files;
}

// In the folder that was given, or beside the document.
std::optional<fs::path> picture_of(const std::string& image, const std::string& stem,
                                   const fs::path* folder, const fs::path& poses) {
  if (!folder) return image.empty() ? std::nullopt : if_there(poses.parent_path() / image);
  if (!image.empty())
    if (auto found = if_there(*folder / fs::path(image).filename())) return found;
  for (const char* ending : {".png", ".jpg", ".jpeg"})
    if (auto found = if_there(*folder / (stem + ending))) return found;
  return std::nullopt;
}

std::string size_text(int width, int height) {
  return std::to_string(width) + "x" + std::to_string(height);
}

// The lens of the pixels of a map or a picture: the camera's, at whatever size.
Intrinsics lens_at_size(const fs::path& path, const Intrinsics& lens, int width, int height) {
  if (is_scaled_picture(lens, width, height)) return scaled_lens(lens, width, height);
  throw BadDataError(path, "is " + size_text(width, height) + ", its camera " +
                               size_text(lens.width, lens.height) +
                               "; they must be of one size, or one the other's made smaller");
}

void add_picture(const fs::path& path, const Intrinsics& lens, DepthView& view) {
  view.color = read_photo(path);
  view.color_lens = lens_at_size(path, lens, view.color.width, view.color.height);
}

// What the map says of its own camera goes before the lens of the poses, which may have been
// straightened or rectified for it. A lens that was assumed says nothing.
void set_camera(const fs::path& path, const PosedCamera& posed, const DepthMap& map,
                const RunContext& context, DepthView& view) {
  const int width = map.depth.width, height = map.depth.height;
  view.camera = posed;
  const bool own = map.facts.camera && map.has_note(kWorldNote, kScopesOwnAxes) &&
                   !map.has_note(kLensNote, kAssumedLens);
  if (!own) {
    view.camera.intrinsics = lens_at_size(path, pinhole_of(posed.intrinsics), width, height);
    if (map.has_note(kLensNote, kAssumedLens))
      context.warn(path.filename().string() +
                   " was made without a lens, with a field of view that was assumed; the poses' "
                   "lens is taken for it here, but give it to shade as well (--intrinsics)");
    return;
  }
  view.camera.intrinsics = map.facts.camera->intrinsics;
  // How stereo's left eye was turned to be rectified; its own cameras.json has that already.
  const auto turn = written_rotation(map.facts.camera->camera_from_world.rotation);
  constexpr double kSevenDigits = 1e-5;
  if (!turn || turn->isApprox(posed.camera_from_world.rotation, kSevenDigits)) return;
  view.camera.camera_from_world = RigidTransform{*turn, {0, 0, 0}} * posed.camera_from_world;
  view.color_from_camera = turn->transpose();
}

DepthView read_view(const StageCall& call, const DepthFile& file, const CameraSet& set,
                    std::size_t at, double mm_per_unit) {
  DepthMap map = read_depth_map(file.depth, call.context);
  DepthView view;
  view.name = file.depth.string();
  view.relative = map.has_note(kDepthUnitNote, kRelativeDepth);
  set_camera(file.depth, set.cameras[at], map, call.context, view);
  view.depth_mm = std::move(map.depth);
  if (!view.relative && mm_per_unit != 1)
    for (float& z : view.depth_mm.values) z *= static_cast<float>(mm_per_unit);
  if (file.confidence) view.confidence = read_confidence(*file.confidence);
  const std::string image = set.images.empty() ? "" : set.images[at];
  if (const auto picture = picture_of(image, file.depth.stem().string(), call.input("pictures"),
                                      *call.input("poses"))) {
    add_picture(*picture, set.cameras[at].intrinsics, view);
  } else if (file.picture) {
    view.color_from_camera.setIdentity();
    add_picture(*file.picture, view.camera.intrinsics, view);
  }
  return view;
}

// The depth maps of a call with their cameras, confidences and pictures. `mm_per_unit` is of depths
// that are not relative. Throws NoInputError, BadDataError.
DepthViews read_depth_views(const StageCall& call, double mm_per_unit) {
  const fs::path& poses = *call.input("poses");
  const CameraSet set = read_camera_file(poses, call.context);
  const std::vector<DepthFile> files = depth_files(call);
  std::vector<fs::path> maps;
  for (const DepthFile& file : files) maps.push_back(file.depth);
  const MatchedPoses matched = match_poses(maps, set, poses);
  DepthViews result;
  result.by_number = matched.by_number;
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (matched.camera[i]) {
      result.views.push_back(read_view(call, files[i], set, *matched.camera[i], mm_per_unit));
    } else {
      result.without_pose.push_back(files[i].depth.filename().string());
    }
  }
  return result;
}

// What was left out, and how far the views are apart, said.
void tell_fusion(const FusedSurface& fused, const std::vector<DepthView>& views,
                 const FuseStageOptions& options, const RunContext& context, StageReport& report) {
  const auto pictures = std::count_if(views.begin(), views.end(),
                                      [](const DepthView& view) { return view.color.width > 0; });
  if (pictures == 0)
    report.skipped.push_back(
        {"colours", "no picture is named by the cameras or lies beside the depth maps"});
  if (!options.fusion.refine) report.skipped.push_back({"refined poses", "refine is off"});
  if (options.fusion.holes == Holes::open)
    report.skipped.push_back({"what no depth map shows", "holes are left open (--holes closed)"});
  constexpr double kFarApart = 4;  // voxels
  if (fused.apart_mm > kFarApart * fused.voxel_mm)
    context.warn("the depth maps lie " + to_text(fused.apart_mm, 2) + " mm apart on average" +
                 (options.fusion.refine ? std::string("; their poses are farther off than 1 mm "
                                                      "and a degree, or their depths are wrong")
                                        : std::string("; --refine moves their poses together")));
  report.add("pictures", pictures);
}

void report_fusion(const FusedSurface& fused, std::size_t views, StageReport& report) {
  const MeshTopology topology = analyse_topology(fused.mesh);
  report.add("depth_maps", views);
  report.add("voxel_mm", fused.voxel_mm);
  report.add("truncation_mm", fused.truncation_mm);
  report.add("apart_mm", fused.apart_mm);
  report.add("faces", topology.faces);
  report.add("components", topology.components);
  report.add("closed_manifold", topology.closed_manifold());
  report.add("area_mm2", surface_area(fused.mesh));
  report.add("colored_share", fused.colored_share);
  if (!fused.refined) return;
  report.add("refinement_rounds", fused.refined->rounds);
  report.add("apart_before_mm", fused.refined->before_mm);
  report.add("most_moved_mm", fused.refined->moved_mm);
  report.add("most_turned_rad", fused.refined->turned_rad);
}

// How depths and poses came to one unit, and how large the surface is for that.
void tell_scale(const FusedScale& scale, const RunContext& context, StageReport& report) {
  const SolvedScale& solved = scale.solved;
  const bool each = scale.how == DepthScale::each;
  report.add("scale_solved", std::string(each ? "each" : "one"));
  report.add("scale_of_places", solved.place_factor);
  report.add("scale_apart_share", solved.apart);
  report.add("scale_apart_share_unmoved", solved.apart_unmoved);
  if (each) report.add("scale_of_depths", solved.depth_factor);
  if (!scale.relative) {
    context.warn(
        "the poses are in another unit than the depth maps: the cameras' places were made " +
        to_text(solved.place_factor, 4) +
        " times as large, by which the maps agree; the surface is in the depth maps' unit");
    return;
  }
  const std::string found = each ? "a scale for each map" : "one scale for all maps";
  if (scale.in_poses_unit) {
    context.warn("the depth maps are relative; " + found +
                 " brings them to the poses, and the surface is as large as these say (COLMAP's "
                 "have no unit; they are taken for millimetres)");
    return;
  }
  context.warn(
      "the depth maps are relative, and the scope's motion does not tell how large it is: by " +
      found + " they lie " + percent(solved.apart, 1) + " of the depth apart, and " +
      percent(solved.apart_unmoved, 1) +
      " if it had not moved; the surface has its median depth at an assumed 60 mm");
}

// Which maps were left out, and what told whose poses are whose.
void tell_poses(const DepthViews& read, const RunContext& context, StageReport& report) {
  if (!read.by_number.empty())
    context.info("the poses were matched to the depth maps by the numbers in their names: " +
                 read.by_number);
  if (read.without_pose.empty()) return;
  const std::string what = std::to_string(read.without_pose.size()) + " depth maps without a pose";
  report.skipped.push_back({what, "the first is " + read.without_pose.front()});
  context.warn(what + " were left out; the first is " + read.without_pose.front());
}

StageReport run(const StageCall& call) {
  const auto options = call.options_as<FuseStageOptions>();
  options.fusion.check();
  const DepthViews read = read_depth_views(call, mm_per(options.unit));
  const std::vector<DepthView>& views = read.views;
  const FusedSurface fused = fuse_views(views, options.fusion, call.context);
  write_ply(call.output_folder / "surface.ply", fused.mesh);
  StageReport report;
  tell_poses(read, call.context, report);
  if (fused.scale) tell_scale(*fused.scale, call.context, report);
  if (fused.refined || fused.scale) {
    CameraSet set;
    set.cameras = fused.cameras;
    make_folder(call.output_folder / Stage::kBeside);
    write_file_atomically(call.output_folder / Stage::kBeside / "cameras.json",
                          cameras_to_json(set));
  }
  report_fusion(fused, views.size(), report);
  tell_fusion(fused, views, options, call.context, report);
  return report;
}

}  // namespace
}  // namespace organbake

ORGANBAKE_STAGE_MODULE(organbake::run)
