// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>

#include "organbake/core/error.h"
#include "organbake/dataset/dataset.h"
#include "organbake/decimate/mesh_measures.h"
#include "organbake/formats/mesh_files.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/pipelines/stage.h"
#include "organbake/truth/lens_picture.h"
#include "organbake/volume/read_volume.h"
#include "organbake/volume/volume.h"
#include "stages/inspect/options.h"

namespace organbake {
namespace {

std::vector<double> components(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

void describe(const Volume& volume, StageReport& report) {
  const VolumeFigures figures = volume_figures(volume);
  report.add("kind", "volume");
  report.add("size_voxels", std::vector<double>(figures.size.begin(), figures.size.end()));
  report.add("spacing_mm", components(figures.spacing_mm));
  report.add("extent_mm", components(figures.extent_mm));
  report.add("lowest_corner_mm", components(figures.min_mm));
  report.add("highest_corner_mm", components(figures.max_mm));
  report.add("orientation", figures.orientation);
  report.add("oblique_degrees", figures.oblique_degrees);
  report.add("left_handed", figures.left_handed);
  report.add("lowest_value", figures.range.min);
  report.add("highest_value", figures.range.max);
  if (!volume.slices.corners_mm.empty()) {
    report.add("gantry_tilt_degrees", volume.gantry_tilt_degrees);
    report.add("slice_gaps_mm", slice_gaps_mm(volume));
  }
  if (volume.time_points > 1) report.add("time_points", volume.time_points);
  report.add("warnings", volume.warnings);
}

// Segments of several layers may hide one another: each is read for itself.
std::vector<std::string> label_lines(const std::filesystem::path& path, const Volume& mask,
                                     VolumeReadOptions reading, const RunContext& context) {
  std::vector<std::string> lines;
  const bool layered = std::any_of(mask.label_names.begin(), mask.label_names.end(),
                                   [](const LabelName& name) { return name.layer > 0; });
  if (!layered) {
    for (const LabelFigures& label : label_figures(mask)) lines.push_back(label_line(label));
    return lines;
  }
  for (const LabelName& segment : mask.label_names) {
    reading.label = segment.name;
    std::vector<LabelFigures> figures = label_figures(read_volume(path, reading, context));
    LabelFigures one = figures.empty() ? LabelFigures{} : figures.front();
    one.label = segment.label;
    one.name = segment.name;
    lines.push_back(label_line(one) + ", layer " + std::to_string(segment.layer));
  }
  return lines;
}

void describe(const TriangleMesh& mesh, StageReport& report) {
  const MeshTopology topology = analyse_topology(mesh);
  const Bounds box = bounds(mesh);
  report.add("kind", "mesh");
  report.add("vertices", topology.vertices);
  report.add("faces", topology.faces);
  report.add("components", topology.components);
  report.add("closed_manifold", topology.closed_manifold());
  report.add("holes", topology.boundary_loops);
  report.add("boundary_edges", topology.boundary_edges);
  report.add("non_manifold_edges", topology.non_manifold_edges);
  report.add("non_manifold_vertices", topology.non_manifold_vertices);
  report.add("misoriented_edges", topology.misoriented_edges);
  report.add("degenerate_faces", topology.degenerate_faces);
  report.add("euler_characteristic", topology.euler_characteristic);
  report.add("area_mm2", surface_area(mesh));
  report.add("volume_ml", signed_volume(mesh) / 1000);
  report.add("lowest_corner_mm", components(box.min));
  report.add("highest_corner_mm", components(box.max));
  report.add("vertex_colors", !mesh.colors.empty());
  const SelfIntersections crossing = self_intersections(mesh);
  if (crossing.complete) {
    report.add("self_intersecting_faces", crossing.faces.size());
  } else {
    report.add("self_intersecting_faces",
               "at least " + std::to_string(crossing.faces.size()) +
                   "; so many faces lie upon one another that the search was given up");
  }
}

// That of the file's numbers, judged by the size that they have in the unit they were taken for.
std::string suspected_unit(const TriangleMesh& mesh, const MeshFrame& taken) {
  const MeshUnit unit = *taken.unit;
  const double across_mm = (bounds(mesh).max - bounds(mesh).min).maxCoeff();
  if (plausible_size(mesh, taken.unit_told)) return name_of(unit);
  const auto fitting = unit_of_organ(across_mm / mm_per(unit));
  return fitting ? name_of(*fitting) : "none";
}

void describe_volume_at(const std::filesystem::path& path, const StageCall& call,
                        StageReport& report) {
  const ReadStageOptions reading = call.options_as<InspectStageOptions>().reading;
  const bool folder = std::filesystem::is_directory(path);
  DicomContents listed;
  if (folder && !is_folder_of_masks(path)) listed = dicom_contents(path);
  try {
    VolumeReadOptions options = reading.resolved();
    options.any_time = true;
    options.is_mask = is_folder_of_masks(path);
    const Volume volume = read_volume(path, options, call.context);
    describe(volume, report);
    if (looks_like_mask(volume)) {
      report.add("labels", label_lines(path, volume, options, call.context));
    }
  } catch (const BadDataError& error) {
    // A list of series is an answer of its own; one series that cannot be read is an error.
    if (listed.series.size() < 2 || !reading.series.empty()) throw;
    report.add("kind", "dicom-folder");
    report.add("no_volume", std::string(error.what()));
  }
  if (listed.series.empty()) return;
  report.add("series", listed.series);
  report.add("other_files", listed.other_files);
}

// `organbake inspect` of a volume or mesh; of `verify` the text of what only the player reads,
// which throws for what a schema cannot say.
StageReport run(const StageCall& call) {
  StageReport report;
  if (const auto* path = call.input("dataset")) {
    dataset_spec_from_json(call.options_as<std::string>(), path->string());
  } else if (const auto* path = call.input("scope-lens")) {
    scope_lens_from_json(call.options_as<std::string>(), path->string());
  } else if (const auto* path = call.input("mesh")) {
    const auto asked = call.options_as<InspectStageOptions>();
    MeshFrame frame;
    const TriangleMesh mesh = read_mesh(*path, asked.frame, call.context, frame);
    describe(mesh, report);
    report.add("unit", name_of(*frame.unit));
    report.add("space", name_of(*frame.space));
    report.add("suspected_unit", suspected_unit(mesh, frame));
  } else {
    describe_volume_at(*call.input("volume"), call, report);
  }
  return report;
}

}  // namespace
}  // namespace organbake

ORGANBAKE_STAGE_MODULE(organbake::run)
