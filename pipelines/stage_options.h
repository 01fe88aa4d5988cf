// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>

#include "bundle/map_files.h"
#include "capture/capture.h"
#include "capture/filtered_detail.h"
#include "decimate/decimate.h"
#include "formats/mesh_files.h"
#include "fusion/fuse_views.h"
#include "isosurface/isosurface.h"
#include "mechanics/mechanics.h"
#include "phantom/laparoscopy.h"
#include "phantom/phantom.h"
#include "pipelines/options.h"
#include "pipelines/options_json.h"
#include "registration/register_photo.h"
#include "repair/repair.h"
#include "shading/depth_mesh.h"
#include "shading/frame_depth.h"
#include "shading/frame_source.h"
#include "shading/stereo_frame.h"
#include "stereo/stereo_depth.h"
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
  int time = 0;     // of several time points, from 1

  // Inline, so that only the stages' modules need what parses a region.
  VolumeReadOptions resolved() const {
    VolumeReadOptions options{.series = series, .strict = strict, .time = time};
    if (!roi.empty()) options.region = parse_region(roi, "--roi");
    return options;
  }
};

struct IsosurfaceStageOptions {
  IsosurfaceOptions surface;
  std::string label = "1";  // number, name, or several of them
  bool each_label = false;  // a file for every label of the mask, in a folder
  ReadStageOptions reading;
};

// A mesh that the command reads, and the unit of files that don't say theirs.
struct DecimateStageOptions {
  DecimateOptions decimate;          // but for its faces
  std::optional<double> faces = 80;  // none: as many as a tool can dent
  double tool_radius_mm = 5;         // of that tool's tip
  MeshUnit unit = MeshUnit::mm;
};

struct MechanicsStageOptions {
  MechanicsOptions mechanics;
  MeshUnit unit = MeshUnit::mm;
};

struct RepairStageOptions {
  std::string mode = "auto";  // or none: the surface as it is
  RepairOptions repair;
  MeshUnit unit = MeshUnit::mm;
};

struct InspectStageOptions {
  ReadStageOptions reading;
  MeshUnit unit = MeshUnit::mm;
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
  bool strict = false;
  bool keep_light = false;  // in surface.ply's colours

  // Throws UsageError.
  void resolve();
};

struct StereoStageOptions {
  StereoOptions stereo;
  DepthMeshOptions mesh;
  StereoLayout layout = StereoLayout::none;  // none = seen from the first frame
  bool swap_eyes = false;
  bool masks = true;
  int every = 1, sharpest = 1;
  int mesh_frame = -1;  // −1 = the one with the most confidence
  MeshUnit unit = MeshUnit::mm;
  bool strict = false;
  bool keep_light = false;  // in surface.ply's colours
};

struct FuseStageOptions {
  FusionOptions fusion;
  MeshUnit unit = MeshUnit::mm;  // of the depths
};

struct PlaceStageOptions {
  PlacementOptions placement;
  Eigen::Vector3d cone_axis = ViewingCone().axis;
  double cone_angle_rad = 0;      // half angle; 0 = cameras all round
  CoverageGoal goal{.share = 0};  // share 0 = go by count
  CoverageDetail report = CoverageDetail::brief;
  MeshUnit unit = MeshUnit::mm;

  PlacementOptions resolved() const;
};

// Which files a pose is written to besides our own.
enum class CameraExport { none, colmap, transforms };

struct RegisterStageOptions {
  RegistrationOptions registration;
  bool closed_outline = false;  // the organ ends where the mesh does
  bool vertex_albedo = false;   // the surface's colours are its albedo
  bool from_poses = false;      // start from the poses that the document of unposed photos has
  CameraExport also = CameraExport::none;
  MeshUnit unit = MeshUnit::mm;
};

struct CaptureStageOptions {
  CaptureOptions capture;
  DetailOptions detail;
  double surface_edge_mm = 0;  // of the coloured surface; 0 = as it came
  double skin_edge_mm = 6;     // of the smooth skin over the proxy; 0 = none
  Material material;
  double exemplar_mm_per_pixel = 0;  // of the exemplar's pixels on its tissue; 0: there is none
  MapPacking packing;
  MeshUnit unit = MeshUnit::mm;
};

inline constexpr const char* kWebPageFile = "organ.html";  // of an export for the web
// What a bundle is written as for other programs.
enum class ExportFormat { gltf, colmap, transforms, obj, usd, sofa, web };
struct ExportOptions {
  ExportFormat format = ExportFormat::gltf;
  std::size_t faces = 10000;      // of the surface; 0: all of the base layer's
  std::optional<double> texture;  // side in texels; none: 2048 for gltf and usd, as the maps else
  bool albedo = false;            // colours freed from the light that they were baked in
};

struct BundleOptions {
  bool surface = false;
};

void bind(OptionList& list, PhantomStageOptions& options);
void bind(OptionList& list, ReadStageOptions& options);
void bind(OptionList& list, IsosurfaceStageOptions& options);
void bind_unit(OptionList& list, MeshUnit& unit,
               const char* help = "of a mesh file that doesn't say its own; glTF is in metres");
// Of the stages that read a clip: which of its frames, and the one that becomes a surface.
// selection_of() throws UsageError where both say which frames are taken.
SelectionOptions selection_of(int every, int sharpest);
void bind_frames(OptionList& list, int& every, int& sharpest);
void bind_key_frame(OptionList& list, bool& keep_light, bool& strict, int& mesh_frame,
                    DepthMeshOptions& mesh);
void bind(OptionList& list, DecimateStageOptions& options);
void bind(OptionList& list, InspectStageOptions& options);
void bind(OptionList& list, RepairStageOptions& options);
void bind(OptionList& list, MechanicsStageOptions& options);
void bind(OptionList& list, ShadeStageOptions& options);
void bind(OptionList& list, StereoStageOptions& options);
void bind(OptionList& list, FuseStageOptions& options);
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
