// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/isosurface/isosurface.h"

#include <algorithm>
#include <filesystem>

#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/formats/mesh_files.h"
#include "organbake/geometry/ply.h"
#include "organbake/pipelines/stage.h"
#include "organbake/volume/read_volume.h"
#include "stages/isosurface/options.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

// A grid alone is told of when its voxels are read.
std::optional<Volume> read_input(const StageCall& call, const std::string& name,
                                 const VolumeReadOptions& options) {
  const auto* path = call.input(name);
  if (!path) return std::nullopt;
  Volume volume = read_volume(*path, options, call.context);
  if (volume.voxel_count() == 0) return volume;
  for (const std::string& warning : volume.warnings) call.context.warn(name + ": " + warning);
  return volume;
}

// A mask lies where its own header puts it; the tissue below it tells whether that is right.
void tell_place(const MaskCheck& check, const RunContext& context, StageReport& report) {
  if (check.overlap_share == 0) throw BadDataError("mask: " + check.message);
  if (!check.message.empty()) context.warn("mask: " + check.message);
  report.add("mask_plausible", check.plausible);
  report.add("mask_overlap_share", check.overlap_share);
  report.add("mask_soft_tissue_share", check.fit.soft_tissue_share);
  report.add("mask_deviation_hu", check.fit.deviation_hu);
}

// A series and a time are of the CT; a mask of a whole scan is cut to the region like the CT.
VolumeReadOptions for_mask(const StageCall& call, const IsosurfaceStageOptions& options,
                           const std::optional<Volume>& ct, const std::string& label) {
  VolumeReadOptions reading = options.reading.resolved();
  reading.series.clear();
  reading.is_mask = true;
  reading.only_channels = ct && ct->time_points == 1;
  reading.scan = ct ? &*ct : nullptr;
  reading.label = label;
  if (const auto* names = call.input("label_names")) {
    reading.label_names = read_label_names(*names);
  }
  return reading;
}

// Of a mask's several phases one may be asked for though its CT has but one.
VolumeReadOptions for_ct(const StageCall& call, const IsosurfaceStageOptions& options) {
  VolumeReadOptions reading = options.reading.resolved();
  reading.lasting = call.input("mask") != nullptr;
  return reading;
}

void check_time(const std::optional<Volume>& ct, const std::optional<Volume>& mask, int time) {
  if (time < 2 || !ct || !mask || ct->time_points > 1 || mask->time_points > 1) return;
  throw UsageError("neither the CT nor the mask holds several time points, no --time " +
                   std::to_string(time));
}

// Of a CT in a file only the grid is read at first: the mask tells which voxels are needed. A DICOM
// folder is read once, since all of its slices would be opened for their places alone.
std::optional<Volume> read_grid(const StageCall& call, VolumeReadOptions options) {
  const auto* path = call.input("ct");
  options.grid_only = path && call.input("mask") && !options.region && fs::is_regular_file(*path);
  return read_input(call, "ct", options);
}

// Where the CT's grid alone is known its voxels around the label are read, and all of them only
// where those raise a doubt.
MaskCheck check_on_ct(const StageCall& call, VolumeReadOptions reading, const Volume& ct,
                      const Volume& mask) {
  if (ct.voxel_count() > 0) return check_mask(ct, mask, mask.chosen_label);
  reading.region = region_around(mask, bounding_box(mask, mask.chosen_label));
  if (voxels_within(ct, *reading.region)) {
    const MaskCheck check = check_mask(*read_input(call, "ct", reading), mask, mask.chosen_label);
    if (check.plausible) return check;
  }
  reading.region.reset();
  return check_mask(*read_input(call, "ct", reading), mask, mask.chosen_label);
}

Isosurface label_surface(const Volume& mask, IsosurfaceOptions options, const RunContext& context,
                         const std::optional<Volume>& ct) {
  options.label = mask.chosen_label;
  return extract_label_surface(mask, options, context, ct ? &*ct : nullptr);
}

// A header may have its spacing in another unit than it says. Small organs are common, scans that
// are small as a whole are not: the least field of a clinical CT, a dental one's, is 40 mm.
void question_size(const TriangleMesh& surface, const Volume& grid, const RunContext& context) {
  constexpr double kSmallestScan_mm = 40;
  const auto across = [](const Eigen::Vector3d& size_mm) {
    return to_text(size_mm.maxCoeff(), 1) + " mm across";
  };
  const Eigen::Vector3d size_mm = bounds(surface).max - bounds(surface).min;
  const Eigen::Vector3d grid_mm = grid.spacing_mm.cwiseProduct(
      Eigen::Map<const Eigen::Vector3i>(grid.size.data()).cast<double>());
  const bool small_scan = !organ_sized(size_mm.maxCoeff()) && grid_mm.maxCoeff() < kSmallestScan_mm;
  if (may_be_organ(size_mm.maxCoeff()) && !small_scan) return;
  std::string text = "the surface is " + across(size_mm) + ", and the volume " + across(grid_mm) +
                     "; check that it is the right organ and that the header's spacing is in mm";
  if (const auto unit = unit_of_organ(size_mm.maxCoeff());
      small_scan && unit && *unit != MeshUnit::mm)
    text += ": in " + std::string(in_words(*unit)) + " the surface would be " +
            across(mm_per(*unit) * size_mm);
  context.warn(text);
}

// The volumes end here: they are not needed while the mesh is written.
Isosurface make_surface(const StageCall& call, const IsosurfaceStageOptions& options,
                        StageReport& report) {
  const VolumeReadOptions reading = for_ct(call, options);
  const std::optional<Volume> ct = read_grid(call, reading);
  const std::optional<Volume> mask =
      read_input(call, "mask", for_mask(call, options, ct, options.label));
  check_time(ct, mask, reading.time);
  if (mask && ct) tell_place(check_on_ct(call, reading, *ct, *mask), call.context, report);
  Isosurface surface = mask ? label_surface(*mask, options.surface, call.context, ct)
                            : extract_isosurface(*ct, options.surface, call.context);
  question_size(surface.mesh, mask ? *mask : *ct, call.context);
  return surface;
}

// A label's name as the name of a file: "label_5" where it has none.
std::string file_name(const LabelName& label) {
  if (label.name.empty()) return "label_" + std::to_string(label.label);
  std::string name = label.name;
  for (char& c : name) {
    const bool plain = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                       c == '-' || c == '.' || static_cast<unsigned char>(c) >= 0x80;
    if (!plain) c = '_';
  }
  return name[0] == '.' ? "_" + name : name;
}

bool is_layered(const Volume& mask) {
  return std::any_of(mask.label_names.begin(), mask.label_names.end(),
                     [](const LabelName& name) { return name.layer > 0; });
}

// The labels that voxels have, with the names that the file gives them; segments of layers may hide
// one another, so all of those count.
std::vector<LabelName> labels_of(const Volume& mask) {
  if (is_layered(mask)) return mask.label_names;
  std::vector<LabelName> labels;
  for (const LabelCount& count : count_labels(mask)) {
    LabelName label{count.label, {}};
    for (const LabelName& known : mask.label_names) {
      if (known.label == count.label) label.name = known.name;
    }
    labels.push_back(label);
  }
  return labels;
}

// Every label's surface as a file of its own. One that gives none is told and left out.
StageReport run_each_label(const StageCall& call, const IsosurfaceStageOptions& options) {
  const auto* path = call.input("mask");
  if (!path) throw UsageError("--each-label needs a mask: --mask FILE");
  const std::optional<Volume> ct = read_input(call, "ct", for_ct(call, options));
  const std::optional<Volume> mask = read_input(call, "mask", for_mask(call, options, ct, {}));
  check_time(ct, mask, options.reading.time);
  const std::vector<LabelName> labels = labels_of(*mask);
  if (labels.empty()) throw BadDataError(*path, "holds no label");
  StageReport report;
  std::vector<std::string> written, left_out;
  std::string first_error;
  for (const LabelName& label : labels) {
    const std::string name = file_name(label);
    const std::string text = label.name.empty() ? std::to_string(label.label) : label.name;
    try {
      Volume one = is_layered(*mask)
                       ? read_volume(*path, for_mask(call, options, ct, text), call.context)
                       : *mask;
      one.chosen_label = label.label;
      one.chosen_name = label.name;
      StageReport placing;
      if (ct) tell_place(check_mask(*ct, one, label.label), call.context, placing);
      const Isosurface surface = label_surface(one, options.surface, call.context, ct);
      write_ply(call.output_folder / (name + ".ply"), surface.mesh);
      report.add("volume_ml_" + name, signed_volume(surface.mesh) / 1000);
      written.push_back(std::to_string(label.label) + " " + name);
    } catch (const BadDataError& error) {
      if (first_error.empty()) first_error = error.what();
      call.context.warn("label " + text + " is left out: " + error.what());
      left_out.push_back(text);
    }
  }
  if (written.empty()) throw BadDataError(*path, "no label gives a surface: " + first_error);
  report.add("labels", written);
  report.add("labels_left_out", left_out);
  return report;
}

StageReport run(const StageCall& call) {
  const auto options = call.options_as<IsosurfaceStageOptions>();
  if (options.each_label) return run_each_label(call, options);
  if (!call.input("mask") && options.label != IsosurfaceStageOptions().label) {
    throw UsageError("label is \"" + options.label +
                     "\", but there is no mask: give the mask that has it (--mask FILE), or leave "
                     "label out");
  }
  StageReport report;
  const Isosurface surface = make_surface(call, options, report);
  write_ply(call.output_folder / "surface.ply", surface.mesh);

  report.add("vertices", surface.mesh.vertices.size());
  report.add("faces", surface.mesh.faces.size());
  report.add("components_found", surface.components_found);
  report.add("components_kept", surface.components_kept);
  report.add("volume_ml", signed_volume(surface.mesh) / 1000);
  report.add("left_out_share", surface.left_out_share);
  report.add("cut_area_mm2", surface.cut_area_mm2);
  if (call.input("mask")) {
    report.skipped.push_back({"the level iso, method and refine", "a mask is given"});
  } else {
    report.add("level_hu", surface.level_hu);
    report.skipped.push_back({"label, smooth and keep_volume", "no mask is given"});
  }
  return report;
}

}  // namespace
}  // namespace organbake

ORGANBAKE_STAGE_MODULE(organbake::run)
