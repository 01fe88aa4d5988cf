// SPDX-License-Identifier: GPL-3.0-or-later
#include "bundle/cameras_json.h"
#include "core/files.h"
#include "formats/mesh_files.h"
#include "geometry/ply.h"
#include "pipelines/stage_module.h"
#include "pipelines/stage_options.h"
#include "viewpoints/placement.h"

namespace organbake {
namespace {

StageReport run(const StageCall& call) {
  const PlacementOptions options =
      resolved_options<PlaceStageOptions>(call.options_json).resolved();
  options.check();
  const TriangleMesh surface = read_mesh(*call.input("surface"));
  const Placement placement = place_cameras(surface, options, call.context);
  const CameraSet set{placement.cameras, {}, placement.manifold};
  write_file_atomically(call.output_folder / "cameras.json", cameras_to_json(set));
  write_ply(call.output_folder / "vpm.ply", placement.manifold_surface);

  StageReport report;
  report.add("cameras", placement.cameras.size());
  report.add("vpm_triangles", placement.manifold.triangles.size());
  report.add(
      "distance_mm",
      (placement.cameras.front().center_world_mm() - placement.manifold.center_world_mm).norm());
  if (!options.cone) report.skipped.push_back({"the viewing cone", "cone_angle is 0"});
  return report;
}

}  // namespace
}  // namespace organbake

ORGANBAKE_STAGE_MODULE(organbake::run)
