// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "organbake/bundle/cameras_json.h"
#include "organbake/core/files.h"
#include "organbake/formats/mesh_files.h"
#include "organbake/geometry/ply.h"
#include "organbake/pipelines/stage.h"
#include "organbake/viewpoints/placement.h"
#include "stages/place/options.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

void tell_choice(const PlacementOptions& options, const Placement& placement, StageReport& report) {
  if (!placement.cover) {
    report.skipped.push_back(
        {"the fewest cameras for a coverage", "coverage is 0; count is given"});
    return;
  }
  const CoverSummary& cover = *placement.cover;
  report.add("cameras_for_coverage", cover.for_coverage);
  report.skipped.push_back({"the count", "a coverage is given"});
  if (cover.reached) return;
  report.add("coverage_reached", cover.coverage);
  report.add("coverage_wanted", options.coverage->share);
}

void tell_coverage(const CoverageReport& coverage, StageReport& report) {
  report.add("reachable_share", coverage.reachable_share);
  report.add("hidden_share", coverage.hidden_share);
  report.add("seen_by_1_share", coverage.seen_share[0]);
  report.add("seen_by_2_share", coverage.seen_share[1]);
  report.add("seen_by_3_share", coverage.seen_share[2]);
  report.add("median_texel_mm", coverage.median_texel_mm);
}

void tell_views(const CoverageReport& coverage, StageReport& report) {
  report.add("views", coverage.at_rest.gaps.size());
  report.add("view_gap_mean", coverage.at_rest.mean_gap);
  std::vector<double> poked;
  for (const ViewCertificate& certificate : coverage.poked) poked.push_back(certificate.mean_gap);
  report.add("view_gap_mean_poked", poked);
}

// The size of maps in the middle of which a texel is a pixel of the picture.
int map_size_of_picture(const TriangleMesh& surface, const PosedCamera& picture,
                        PlacementOptions options, int limit) {
  constexpr int kStep = 64, kSmallest = 256;
  options.coverage.reset();
  const Placement placement = place_cameras(surface, options);
  const PosedCamera& map = placement.cameras.front();
  const auto per_mm = [&](const PosedCamera& camera) {
    const double depth_mm = (camera.camera_from_world * placement.manifold.center_world_mm).z();
    return camera.intrinsics.fx / std::max(depth_mm, 1e-6);
  };
  const double size = options.map_size * per_mm(picture) / per_mm(map);
  return std::min(limit, std::max(kSmallest, kStep * static_cast<int>(std::ceil(size / kStep))));
}

StageReport run(const StageCall& call) {
  const auto asked = call.options_as<PlaceStageOptions>();
  PlacementOptions options = asked.resolved();
  const bool own_size = options.map_size == 0;
  if (own_size) options.map_size = PlacementOptions().map_size;
  const TriangleMesh surface = read_mesh(*call.input("surface"), asked.frame, call.context);
  const fs::path* photo = call.input("scope_photo");
  if (own_size && photo) {
    options.map_size = map_size_of_picture(surface, read_cameras(*photo).cameras.front(), options,
                                           asked.size_limit_px);
  }
  const Placement placement = place_cameras(surface, options, call.context);
  const CoverageReport coverage =
      measure_coverage(surface, placement, options, asked.report, call.context);
  const CameraSet set{placement.cameras, {}, placement.manifold};
  write_file_atomically(call.output_folder / "cameras.json", cameras_to_json(set));
  write_ply(call.output_folder / "vpm.ply", placement.manifold_surface);

  StageReport report;
  report.add("cameras", placement.cameras.size());
  if (own_size) report.add("map_size_px", options.map_size);
  report.add("vpm_triangles", placement.manifold.triangles.size());
  report.add(
      "distance_mm",
      (placement.cameras.front().center_world_mm() - placement.manifold.center_world_mm).norm());
  tell_choice(options, placement, report);
  tell_coverage(coverage, report);
  if (asked.report == CoverageDetail::full) {
    tell_views(coverage, report);
    write_ply(call.output_folder / "seen.ply", coverage.painted);
  } else {
    report.skipped.push_back({"what views miss, and seen.ply", "report is brief, not full"});
  }
  if (!options.cone) report.skipped.push_back({"the viewing cone", "cone_angle_deg is 0"});
  return report;
}

}  // namespace
}  // namespace organbake

ORGANBAKE_STAGE_MODULE(organbake::run)
