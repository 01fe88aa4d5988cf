// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "bundle/map_files.h"
#include "capture/capture.h"
#include "capture/filtered_detail.h"
#include "decimate/decimate.h"
#include "isosurface/isosurface.h"
#include "mechanics/mechanics.h"
#include "phantom/laparoscopy.h"
#include "phantom/phantom.h"
#include "pipelines/options.h"
#include "pipelines/options_json.h"
#include "registration/register_photo.h"
#include "shading/depth_mesh.h"
#include "shading/frame_depth.h"
#include "shading/frame_source.h"
#include "viewpoints/placement.h"
#include "volume/read_options.h"

namespace organbake {

// The options of each stage: the library's own structs, with what only a command line needs added.
struct PhantomStageOptions {
  std::string kind = "organ";
  OrganPhantomOptions organ;
  int truth_subdivisions = 7;
  LaparoscopyOptions laparoscopy;
};

// How a volume is read, as flags and recipe keys have it.
struct ReadStageOptions {
  std::string series;
  bool strict = false;
  std::string roi;  // as parse_region reads it; empty = all

  // Inline, so that only the stages' modules need what parses a region.
  VolumeReadOptions resolved() const {
    VolumeReadOptions options{.series = series, .strict = strict};
    if (!roi.empty()) options.region = parse_region(roi, "--roi");
    return options;
  }
};

struct IsosurfaceStageOptions {
  IsosurfaceOptions surface;
  ReadStageOptions reading;
};

struct ShadeStageOptions {
  ShadingOptions shading;
  SelectionOptions selection;
  FrameOptions frame{.halvings = 1};
  DepthMeshOptions mesh;
  Eigen::Vector3d light_offset_mm = Eigen::Vector3d::Zero();
  std::string light = "auto";                     // or "tilt,slant" in rad
  double field_of_view_rad = 1.2217304763960306;  // 70°
  int mesh_frame = -1;                            // −1 = the one with the most confidence
  int sharpest = 1;
  bool from_previous = true;

  // Throws UsageError.
  void resolve();
};

struct PlaceStageOptions {
  PlacementOptions placement;
  Eigen::Vector3d cone_axis = ViewingCone().axis;
  double cone_angle_rad = 0;      // half angle; 0 = cameras all round
  CoverageGoal goal{.share = 0};  // share 0 = go by count
  CoverageDetail report = CoverageDetail::brief;

  PlacementOptions resolved() const;
};

// Which files a pose is written to besides our own.
enum class CameraExport { none, colmap, transforms };

struct RegisterStageOptions {
  RegistrationOptions registration;
  bool vertex_albedo = false;  // the surface's colours are its albedo
  bool from_poses = false;     // start from the poses that the document of unposed photos has
  CameraExport also = CameraExport::none;
};

struct CaptureStageOptions {
  CaptureOptions capture;
  DetailOptions detail;
  double surface_edge_mm = 0;  // of the coloured surface; 0 = as it came
  Material material;
  double exemplar_mm_per_pixel = 0;  // of the exemplar's pixels on its tissue; 0: there is none
  MapPacking packing;
};

// What a bundle is written as for other programs.
enum class ExportFormat { gltf, colmap, transforms, obj };
struct ExportOptions {
  ExportFormat format = ExportFormat::gltf;
};

struct BundleOptions {
  bool surface = false;
};

void bind(OptionList& list, PhantomStageOptions& options);
void bind(OptionList& list, ReadStageOptions& options);
void bind(OptionList& list, IsosurfaceStageOptions& options);
void bind(OptionList& list, DecimateOptions& options);
void bind(OptionList& list, MechanicsOptions& options);
void bind(OptionList& list, ShadeStageOptions& options);
void bind(OptionList& list, PlaceStageOptions& options);
void bind(OptionList& list, RegisterStageOptions& options);
void bind(OptionList& list, CaptureStageOptions& options);
void bind(OptionList& list, ExportOptions& options);
void bind(OptionList& list, BundleOptions& options);

// The resolved options of a stage call, back in their struct.
template <class Options>
Options resolved_options(const std::string& options_json) {
  Options options;
  OptionList list;
  bind(list, options);
  set_from_json_text(list, options_json);
  return options;
}

}  // namespace organbake
