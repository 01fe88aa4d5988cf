// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipelines/stage_options.h"

namespace organbake {
namespace {

// Documents carry numbers as doubles: beyond 2⁵³ whole numbers would silently change.
constexpr double kLargestSeed = 9007199254740991.0;

}  // namespace

PlacementOptions PlaceStageOptions::resolved() const {
  PlacementOptions options = placement;
  if (cone_angle_rad > 0) options.cone = ViewingCone{cone_axis, cone_angle_rad};
  return options;
}

void bind(OptionList& list, PhantomStageOptions& o) {
  list.add("kind", &o.kind, {.help = "what is made", .choices = {"organ"}})
      .add("seed", &o.organ.seed,
           {.help = "of the shape and the noise", .min = 0, .max = kLargestSeed})
      .add("size", &o.organ.ct_size, {.help = "of the CT", .unit = "voxels", .min = 8, .max = 1024})
      .add("spacing", &o.organ.spacing_mm,
           {.help = "between voxels", .unit = "mm", .min = 0.05, .max = 50})
      .add("noise", &o.organ.noise_hu,
           {.help = "of the CT, standard deviation", .unit = "HU", .min = 0, .max = 500})
      .add("photos", &o.organ.photo_count,
           {.help = "photographs from known poses", .min = 0, .max = 256})
      .add("photo_size", &o.organ.photo_size,
           {.help = "of a photograph, square", .unit = "px", .min = 16, .max = 8192})
      .add("truth_subdivisions", &o.truth_subdivisions,
           {.help = "of the true mesh: 20·4ⁿ faces", .min = 1, .max = 9});
}

void bind(OptionList& list, ReadStageOptions& o) {
  list.add("series", &o.series,
           {.help = "of a DICOM folder: its UID or number; else the one that is a CT volume"})
      .add(
          "strict", &o.strict,
          {.help = "refuse a DICOM series with uneven, missing, repeated or damaged slices instead "
                   "of mending it"})
      .add("roi", &o.roi,
           {.help = "two corners x0,y0,z0,x1,y1,z1 of the box that is read; else all",
            .unit = "mm, LPS"});
}

void bind(OptionList& list, IsosurfaceStageOptions& options) {
  IsosurfaceOptions& o = options.surface;
  list.add("iso", &o.iso_hu,
           {.help = "level of the surface when no mask is given; the organ lies above it; auto = "
                    "half-way between the histogram's two peaks",
            .unit = "HU",
            .min = -32768,
            .max = 32767})
      .add("method", &o.method, {.help = "the same triangles, fast, or as the paper makes them"},
           {{"flying-edges", IsosurfaceMethod::flying_edges},
            {"marching-cubes", IsosurfaceMethod::marching_cubes}})
      .add("label", &o.label, {.help = "the organ's label in the mask", .min = 1, .max = 32767})
      .add("largest", &o.largest,
           {.help = "components kept, by area; 0 = all", .min = 0, .max = 1000000})
      .add("min_size", &o.min_size_mm,
           {.help = "components whose box is nowhere longer are dropped",
            .unit = "mm",
            .min = 0,
            .max = 10000})
      .add("refine", &o.refine,
           {.help = "place a CT's surface by all voxels across the edge, not by two of them: right "
                    "inside thick slices"})
      .add("smooth", &o.smooth_mm,
           {.help = "Gaussian on a mask before its surface is taken; 0 leaves voxel stairs",
            .unit = "mm",
            .min = 0,
            .max = 50})
      .add("taubin", &o.taubin_steps,
           {.help = "steps of Taubin smoothing on the surface; its volume is kept",
            .min = 0,
            .max = 1000})
      .add("cap", &o.cap, {.help = "close the surface where it leaves the volume"});
  bind(list, options.reading);
}

void bind(OptionList& list, DecimateOptions& o) {
  list.add("faces", &o.faces,
           {.help = "the proxy has at most this many", .min = 4, .max = 10000000})
      .add("max_error", &o.max_error_mm,
           {.help = "fewest faces within this distance both ways, measured; 0 = go by faces",
            .unit = "mm",
            .min = 0,
            .max = 1e9})
      .add("method", &o.method,
           {.help = "edge collapse and a fit to the surface; or, to compare, plain collapses or "
                    "the paper's naive clustering"},
           {{"fitted", DecimateMethod::fitted},
            {"lindstrom-turk", DecimateMethod::lindstrom_turk},
            {"quadric", DecimateMethod::quadric},
            {"cluster", DecimateMethod::cluster}})
      .add("objective", &o.objective,
           {.help = "of the fit: the RMS distance with the volume kept, or the largest distance"},
           {{"rms", DecimateObjective::rms}, {"max", DecimateObjective::max}})
      .add("flips", &o.flips,
           {.help = "of the fit: flip edges where that lowers the distance, up to 500 faces"});
}

void bind(OptionList& list, MechanicsOptions& o) {
  list.add("young_modulus", &o.young_modulus_kpa,
           {.help = "of the tissue; liver: about 5…15", .unit = "kPa", .min = 1e-3, .max = 1e6})
      .add("density", &o.density_kg_per_m3,
           {.help = "of the tissue", .unit = "kg/m³", .min = 1, .max = 30000})
      .add("thickness", &o.thickness_mm,
           {.help = "of the layer that a surface spring stands for",
            .unit = "mm",
            .min = 0.01,
            .max = 1000})
      .add("damping_ratio", &o.damping_ratio,
           {.help = "of each spring; 1 = critical", .min = 0, .max = 10})
      .add("volume_stiffness", &o.volume_stiffness,
           {.help = "0 = volume free, 1 = kept", .min = 0, .max = 1})
      .add("anchor_fraction", &o.anchor_fraction,
           {.help = "share of the vertices that don't move", .min = 0, .max = 1})
      .add("anchor_direction", &o.anchor_direction,
           {.help = "the vertices farthest along it are held; +y of LPS is the patient's back"})
      .add("instrument_radius", &o.instrument_radius_mm,
           {.help = "of a tool, by default", .unit = "mm", .min = 0.01, .max = 1000});
}

void bind(OptionList& list, PlaceStageOptions& o) {
  list.add("count", &o.placement.count, {.help = "virtual cameras", .min = 1, .max = 256})
      .add("size", &o.placement.map_size,
           {.help = "of their maps, square", .unit = "px", .min = 16, .max = 8192})
      .add("field_of_view", &o.placement.field_of_view_rad,
           {.help = "of each camera", .unit = "rad", .min = 0.01, .max = 2.5})
      .add("margin", &o.placement.margin,
           {.help = "free border round the organ, share of the map", .min = 0, .max = 0.4})
      .add("cone_axis", &o.cone_axis, {.help = "of the viewing cone, from the organ's centre"})
      .add("cone_angle", &o.cone_angle_rad,
           {.help = "half angle of the viewing cone; 0 = cameras all round",
            .unit = "rad",
            .min = 0,
            .max = 1.5});
}

void bind(OptionList& list, RegisterStageOptions& o) {
  RegistrationOptions& r = o.registration;
  list.add("light", &r.light,
           {.help = "where the light is: at the camera (an endoscope), in light_direction, or "
                    "anywhere: estimated with the pose"},
           {{"camera", LightModel::camera},
            {"direction", LightModel::direction},
            {"estimated", LightModel::estimated}})
      .add("light_direction", &r.light_direction,
           {.help = "surface to light in the camera's axes: x right, y down, z forward"})
      .add("similarity", &r.similarity,
           {.help = "what is correlated: radiance, as in the paper, or its gradient"},
           {{"radiance", Similarity::radiance}, {"gradient", Similarity::gradient}})
      .add("form", &r.form,
           {.help = "one correlation per patch with a robust loss, or one for the whole picture"},
           {{"patches", Form::patches}, {"whole", Form::whole}})
      .add("free_focal", &r.free_focal, {.help = "seek one scale of the focal lengths, too"})
      .add("vertex_albedo", &o.vertex_albedo,
           {.help = "take the surface's vertex colours for its albedo"})
      .add("from_poses", &o.from_poses,
           {.help = "of unposed photos: start from the poses in their document"})
      .add("finest_side", &r.finest_side_px,
           {.help = "a photo is halved until no side is longer",
            .unit = "px",
            .min = 64,
            .max = 8192})
      .add("outer_iterations", &r.outer_iterations,
           {.help = "per pyramid level: overlap, light and weights anew", .min = 1, .max = 50})
      .add("solver_iterations", &r.solver_iterations,
           {.help = "of the solver within each", .min = 1, .max = 100})
      .add("also", &o.also, {.help = "write the cameras for other programs as well"},
           {{"none", CameraExport::none},
            {"colmap", CameraExport::colmap},
            {"transforms", CameraExport::transforms}});
}

void bind(OptionList& list, CaptureStageOptions& o) {
  list.add("rays_per_texel_side", &o.capture.rays_per_texel_side,
           {.help = "n×n rays are averaged for a texel's colour", .min = 1, .max = 8})
      .add("base_step", &o.capture.base_step_mm,
           {.help = "spacing of the base layer's nodes", .unit = "mm", .min = 0.05, .max = 100})
      .add("surface_edge", &o.surface_edge_mm,
           {.help =
                "longest edge of the coloured surface that --compare takes for truth, 0 = as it is",
            .unit = "mm",
            .min = 0,
            .max = 100})
      .add("albedo", &o.material.albedo,
           {.help = "of the material that a surface without any colour gets, linear RGB",
            .min = 0,
            .max = 1})
      .add("variation", &o.material.variation,
           {.help = "of the material's albedo", .min = 0, .max = 1})
      .add("feature", &o.material.feature_mm,
           {.help = "size of the material's largest spots", .unit = "mm", .min = 0.01, .max = 1000})
      .add("light_direction", &o.material.light_direction,
           {.help = "surface → light, when a material is lit"})
      .add("ambient", &o.material.ambient,
           {.help = "share of the material's light that has no direction", .min = 0, .max = 1});
}

void bind(OptionList& list, BundleOptions& o) {
  list.add("surface", &o.surface,
           {.help = "keep the coloured surface in the bundle, to compare frames with"});
}

}  // namespace organbake
