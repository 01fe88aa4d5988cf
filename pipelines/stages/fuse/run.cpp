// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/fusion/fuse_views.h"

#include <algorithm>
#include <filesystem>

#include "organbake/bundle/cameras_json.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/formats/mesh_files.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/ply.h"
#include "organbake/pipelines/stage_binding.h"
#include "organbake/pipelines/stage_module.h"
#include "stages/fuse/fuse_source.h"
#include "stages/fuse/options.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

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
                 (options.fusion.refine ? std::string("; their poses are farther off than --place "
                                                      "and --angle say, or their depths are wrong")
                                        : std::string("; --refine moves their poses together")));
  report.add("pictures", pictures);
}

void report_fusion(const FusedSurface& fused, std::size_t views, StageReport& report) {
  const MeshTopology topology = analyse_topology(fused.mesh);
  report.add("depth_maps", views);
  report.add("voxel_mm", fused.voxel_mm);
  report.add("truncation_mm", fused.truncation_mm);
  report.add("pixel_noise_mm", fused.noise_mm);
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
