// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/decimate/decimate.h"

#include <cmath>

#include "organbake/core/error.h"
#include "organbake/core/text.h"

#include "organbake/formats/mesh_files.h"
#include "organbake/geometry/ply.h"
#include "organbake/pipelines/stage.h"
#include "stages/decimate/options.h"

namespace organbake {
namespace {

// Of the organ's thickness: how far off a proxy may lie that faces = auto makes.
constexpr double kServingShare = 0.05;

std::size_t whole(double faces) {
  if (faces != std::floor(faces))
    throw UsageError("faces = " + to_text(faces) + ": take a whole number, or auto");
  return static_cast<std::size_t>(faces);
}

std::size_t auto_faces(const TriangleMesh& surface, double tool_radius_mm,
                       const RunContext& context) {
  const std::size_t faces = faces_for_tool(surface, tool_radius_mm);
  context.info("faces = auto: " + std::to_string(faces) + " or more, which a tip of " +
               to_text(tool_radius_mm) + " mm can dent");
  return faces;
}

StageReport run(const StageCall& call) {
  const auto asked = call.options_as<DecimateStageOptions>();
  DecimateOptions options = asked.decimate;
  if (asked.faces) options.faces = whole(*asked.faces);
  const TriangleMesh surface = read_mesh(*call.input("surface"), asked.frame, call.context);
  if (!asked.faces) {
    options.faces = auto_faces(surface, asked.tool_radius_mm, call.context);
    options.max_share = kServingShare;
  }
  const DecimateResult summary = decimate(surface, options, call.context);
  write_ply(call.output_folder / "proxy.ply", summary.proxy);

  StageReport report;
  report.add("surface_faces", surface.faces.size());
  report.add("faces", summary.proxy.faces.size());
  report.add("rms_mm", summary.rms_mm);
  report.add("max_mm", summary.max_mm);
  report.add("reverse_rms_mm", summary.reverse_rms_mm);
  report.add("reverse_max_mm", summary.reverse_max_mm);
  if (summary.worst_thickness_mm > 0) {
    report.add("worst_share_of_thickness", summary.worst_share);
    report.add("worst_mm", summary.worst_mm);
    report.add("worst_thickness_mm", summary.worst_thickness_mm);
  }
  if (options.max_share > 0) report.add("share_of_thickness_asked", options.max_share);
  report.add("volume_change", summary.volume_change);
  report.add("closed_manifold", summary.closed_manifold);
  report.add("components", summary.components);
  report.add("genus", summary.genus);
  report.add("boundary_loops", summary.boundary_loops);
  report.add("self_intersecting_faces", summary.self_intersecting_faces);
  return report;
}

}  // namespace
}  // namespace organbake

ORGANBAKE_STAGE_MODULE(organbake::run)
