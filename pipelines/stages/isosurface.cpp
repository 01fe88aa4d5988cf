// SPDX-License-Identifier: GPL-3.0-or-later
#include "isosurface/isosurface.h"

#include <optional>

#include "geometry/ply.h"
#include "pipelines/stage_module.h"
#include "pipelines/stage_options.h"
#include "volume/mask_check.h"
#include "volume/read_volume.h"

namespace organbake {
namespace {

std::optional<Volume> read_input(const StageCall& call, const std::string& name,
                                 const VolumeReadOptions& options) {
  const auto* path = call.input(name);
  if (!path) return std::nullopt;
  Volume volume = read_volume(*path, options, call.context);
  for (const std::string& warning : volume.warnings) call.context.warn(name + ": " + warning);
  return volume;
}

// A mask goes where its own header puts it; the tissue below it tells whether that is right.
Volume placed_on(const Volume& ct, Volume mask, int label, const RunContext& context,
                 StageReport& report) {
  MaskCheckOptions options;
  options.label = label;
  const MaskCheck check = check_mask(ct, mask, options);
  if (!check.message.empty()) context.warn("mask: " + check.message);
  report.add("mask_plausible", check.plausible);
  report.add("mask_overlap_share", check.overlap_share);
  report.add("mask_soft_tissue_share", check.fit.soft_tissue_share);
  report.add("mask_deviation_hu", check.fit.deviation_hu);
  if (check.grids_equal) return mask;
  context.info("the mask is brought from its own grid onto the CT's");
  return resample_mask(mask, ct);
}

// A series is of the CT's folder; a mask of a whole scan is cut to the region like the CT.
VolumeReadOptions for_mask(VolumeReadOptions options) {
  options.series.clear();
  return options;
}

// The volumes end here: they are not needed while the mesh is written.
Isosurface make_surface(const StageCall& call, const IsosurfaceStageOptions& options,
                        StageReport& report) {
  const VolumeReadOptions reading = options.reading.resolved();
  const std::optional<Volume> ct = read_input(call, "ct", reading);
  std::optional<Volume> mask = read_input(call, "mask", for_mask(reading));
  if (!mask) return extract_isosurface(*ct, options.surface, call.context);
  if (ct) mask = placed_on(*ct, std::move(*mask), options.surface.label, call.context, report);
  return extract_label_surface(*mask, options.surface, call.context);
}

StageReport run(const StageCall& call) {
  const auto options = resolved_options<IsosurfaceStageOptions>(call.options_json);
  options.surface.check();
  StageReport report;
  const Isosurface surface = make_surface(call, options, report);
  write_ply(call.output_folder / "surface.ply", surface.mesh);

  report.add("vertices", surface.mesh.vertices.size());
  report.add("faces", surface.mesh.faces.size());
  report.add("components_found", surface.components_found);
  report.add("components_kept", surface.components_kept);
  report.add("volume_ml", signed_volume(surface.mesh) / 1000);
  if (call.input("mask")) {
    report.skipped.push_back({"the level iso, method and refine", "a mask is given"});
  } else {
    report.add("level_hu", surface.level_hu);
    report.skipped.push_back({"label and smooth", "no mask is given"});
  }
  return report;
}

}  // namespace
}  // namespace organbake

ORGANBAKE_STAGE_MODULE(organbake::run)
