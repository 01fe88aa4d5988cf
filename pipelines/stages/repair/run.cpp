// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/repair/repair.h"

#include "organbake/formats/mesh_files.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/ply.h"
#include "organbake/pipelines/stage.h"
#include "stages/repair/options.h"

namespace organbake {
namespace {

StageReport run(const StageCall& call) {
  const auto asked = call.options_as<RepairStageOptions>();
  const TriangleMesh surface = read_mesh(*call.input("mesh"), asked.frame, call.context);
  RepairSummary summary;
  if (asked.mode == "none") {
    summary.mesh = surface;
  } else {
    summary = repair(surface, asked.repair, call.context);
  }
  for (const std::string& done : summary.done) call.context.info(done);
  write_ply(call.output_folder / "surface.ply", summary.mesh);

  const MeshTopology topology = analyse_topology(summary.mesh);
  StageReport report;
  report.add("done", summary.done);
  report.add("faces", topology.faces);
  report.add("components", topology.components);
  report.add("closed_manifold", topology.closed_manifold());
  report.add("genus", summary.genus);
  report.add("holes_left_open", summary.open_loops);
  report.add("wrapped", summary.wrapped);
  report.add("volume_ml", signed_volume(summary.mesh) / 1000);
  report.add("volume_change", summary.volume_change);
  report.add("max_mm", summary.max_mm);
  report.add("reverse_max_mm", summary.reverse_max_mm);
  return report;
}

}  // namespace
}  // namespace organbake

ORGANBAKE_STAGE_MODULE(organbake::run)
