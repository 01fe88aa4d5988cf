// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipelines/stage_options.h"

#include <cmath>
#include <cstdio>

#include "core/error.h"

namespace organbake {
namespace {

// Documents carry numbers as doubles: beyond 2⁵³ whole numbers would silently change.
constexpr double kLargestSeed = 9007199254740991.0;

}  // namespace

PlacementOptions PlaceStageOptions::resolved() const {
  PlacementOptions options = placement;
  if (cone_angle_rad > 0) options.cone = ViewingCone{cone_axis, cone_angle_rad};
  if (goal.share > 0) options.coverage = goal;
  return options;
}

void bind(OptionList& list, PhantomStageOptions& o) {
  list.add("kind", &o.kind, {.help = "what is made", .choices = {"organ", "laparoscopy"}})
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
           {.help = "of the true mesh: 20·4ⁿ faces", .min = 1, .max = 9})
      .add("frames", &o.laparoscopy.frames, {.help = "of a laparoscopy", .min = 1, .max = 100000})
      .add("frame_width", &o.laparoscopy.width,
           {.help = "of a laparoscopy's frame", .unit = "px", .min = 16, .max = 4096})
      .add("frame_height", &o.laparoscopy.height,
           {.help = "of a laparoscopy's frame", .unit = "px", .min = 16, .max = 4096})
      .add("frame_noise", &o.laparoscopy.noise,
           {.help = "of a laparoscopy, share of full scale", .min = 0, .max = 0.5})
      .add("texture", &o.laparoscopy.texture,
           {.help = "of the albedo of a laparoscopy's tissue", .min = 0, .max = 0.9})
      .add("highlights", &o.laparoscopy.highlights,
           {.help = "strength of a laparoscopy's mirror reflections", .min = 0, .max = 10})
      .add("instrument", &o.laparoscopy.instrument,
           {.help = "a steel instrument comes into a laparoscopy's view"})
      .add("light_beside", &o.laparoscopy.light_offset_x_mm,
           {.help = "of a laparoscopy's light, right of the lens",
            .unit = "mm",
            .min = -20,
            .max = 20});
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
           {.help = "of a tool, by default", .unit = "mm", .min = 0.01, .max = 1000})
      .add("fem", &o.fem, {.help = "tetrahedra too, for organplay --solver fem"})
      .add("fem_cell", &o.fem_cell_mm,
           {.help = "of the lattice that they are cut from; 0 = by the proxy's edges",
            .unit = "mm",
            .min = 0,
            .max = 1000})
      .add("poisson_ratio", &o.poisson_ratio,
           {.help = "of the tetrahedra; 0.5 would be incompressible", .min = 0, .max = 0.49})
      .add("fit_to_fem", &o.fit_to_fem,
           {.help = "fit the springs' constants to the tetrahedra's response to dead loads; small "
                    "proxies get springs between all their vertices"});
}

void ShadeStageOptions::resolve() {
  if (light_offset_mm.z() != 0)
    throw UsageError("light_offset: its third component must be 0; the light lies beside the lens");
  shading.laparoscope.light_offset_x_mm = light_offset_mm.x();
  shading.laparoscope.light_offset_y_mm = light_offset_mm.y();
  if (selection.every > 1 && sharpest > 1)
    throw UsageError("give either every or sharpest: both say which frames are taken");
  if (sharpest > 1) {
    selection.every = sharpest;
    selection.sharpest = true;
  }
  if (light == "auto") return;
  DistantLight given;
  char rest = 0;
  if (std::sscanf(light.c_str(), "%lf,%lf%c", &given.tilt_rad, &given.slant_rad, &rest) != 2 ||
      !(given.slant_rad >= 0 && given.slant_rad <= 1.5708) || !(std::abs(given.tilt_rad) < 1e6))
    throw UsageError("light is '" + light +
                     "'; it must be auto, or tilt,slant in rad (slant 0…1.5708), such as 0.5,0.7");
  shading.light = given;
}

void bind(OptionList& list, ShadeStageOptions& o) {
  list.add("model", &o.shading.model,
           {.help = "perspective camera with its light beside the lens; or a distant light: the "
                    "paper's method, or whole-image least squares"},
           {{"laparoscope", ShadingModel::laparoscope},
            {"tsai-shah", ShadingModel::tsai_shah},
            {"distant", ShadingModel::distant}})
      .add("light", &o.light,
           {.help = "of a distant model: auto, or tilt,slant (0 = right, turning down)",
            .unit = "rad"})
      .add("light_offset", &o.light_offset_mm,
           {.help = "of the laparoscope's light from its lens, right and down; needs a range",
            .unit = "mm",
            .min = -50,
            .max = 50})
      .add("beam", &o.shading.laparoscope.beam_exponent,
           {.help = "the light falls off as cosⁿ of the angle to the axis; 0 = even",
            .min = 0,
            .max = 20})
      .add("range_mm", &o.shading.range_mm,
           {.help = "median distance of the tissue, makes depth metric; 0 = unknown",
            .unit = "mm",
            .min = 0,
            .max = 10000})
      .add("albedo", &o.shading.albedo,
           {.help = "brightness (0…1, linear) = albedo · cos / r²; makes depth metric; 0 = unknown",
            .unit = "mm²",
            .min = 0,
            .max = 1e9})
      .add("field_of_view", &o.field_of_view_rad,
           {.help = "across the frame's width when no intrinsics are given",
            .unit = "rad",
            .min = 0.05,
            .max = 2.8})
      .add("texture", &o.shading.laparoscope.texture,
           {.help = "share of brightness that is not taken for shape", .min = 1e-4, .max = 1})
      .add("iterations", &o.shading.iterations, {.help = "of Tsai–Shah", .min = 1, .max = 100000})
      .add("every", &o.selection.every, {.help = "take one frame in N", .min = 1, .max = 1000000})
      .add("sharpest", &o.sharpest,
           {.help = "take the sharpest frame of each K", .min = 1, .max = 100000})
      .add("halvings", &o.frame.halvings,
           {.help = "of the frames' size before anything else", .min = 0, .max = 4})
      .add("masks", &o.frame.masks,
           {.help = "look for the round field of view, highlights and instruments"})
      .add("piecewise_albedo", &o.frame.piecewise_albedo,
           {.help = "bring tissues of different colour to one albedo"})
      .add("from_previous", &o.from_previous,
           {.help = "a frame like the one before starts from its depth"})
      .add("mesh_frame", &o.mesh_frame,
           {.help = "frame of the clip that becomes surface.ply; -1 = the most confident",
            .min = -1,
            .max = 100000000})
      .add("mesh_step", &o.mesh.step_px, {.help = "of its grid", .unit = "px", .min = 1, .max = 64})
      .add("tear", &o.mesh.tear,
           {.help = "neighbours whose depths differ by a larger share are not joined",
            .min = 1e-4,
            .max = 1});
}

void bind(OptionList& list, PlaceStageOptions& o) {
  list.add("count", &o.placement.count,
           {.help = "virtual cameras, evenly spread", .min = 1, .max = 256})
      .add("coverage", &o.goal.share,
           {.help = "instead of a count: the fewest cameras that see this share of the reachable "
                    "area; 0 = go by count",
            .min = 0,
            .max = 1})
      .add("overlap", &o.goal.overlap,
           {.help = "cameras that must see it, of a coverage", .min = 1, .max = 4})
      .add("texel", &o.goal.texel_mm,
           {.help = "longest side of a texel on what counts as seen; 0 = any",
            .unit = "mm",
            .min = 0,
            .max = 1000})
      .add("view_gap", &o.goal.view_gap,
           {.help = "of a coverage: cameras are added until views miss at most this share of what "
                    "they show; 1 = never",
            .min = 0,
            .max = 1})
      .add("candidates", &o.goal.candidates,
           {.help = "directions to choose from, of a coverage", .min = 16, .max = 8192})
      .add("samples", &o.goal.samples,
           {.help =
                "of the surface to choose by, of a coverage; where it is deeply folded the hardest "
                "to see of a hundred times as many",
            .min = 64,
            .max = 65536})
      .add("size", &o.placement.map_size,
           {.help = "of their maps, square", .unit = "px", .min = 16, .max = 8192})
      .add("field_of_view", &o.placement.field_of_view_rad,
           {.help = "of each camera", .unit = "rad", .min = 0.01, .max = 2.5})
      .add("margin", &o.placement.margin,
           {.help = "free border round the organ, share of the map", .min = 0, .max = 0.4})
      .add("cone_axis", &o.cone_axis, {.help = "of the viewing cone, from the organ's centre"})
      .add("cone_angle", &o.cone_angle_rad,
           {.help = "half angle of the viewing cone, 1.571 = a hemisphere; 0 = cameras all round",
            .unit = "rad",
            .min = 0,
            .max = 1.571})
      .add("report", &o.report,
           {.help = "brief: coverage and texel sizes, from fewer samples; full: what views miss as "
                    "well, at rest and poked, and the surface painted by what cameras see"},
           {{"brief", CoverageDetail::brief}, {"full", CoverageDetail::full}});
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
           {.help = "n×n rays are averaged for a texel's colour; 0: 1 where it hardly changes "
                    "within a texel, or else 2",
            .min = 0,
            .max = 8})
      .add("base_step", &o.capture.base_step_mm,
           {.help = "spacing of the base layer's nodes", .unit = "mm", .min = 0.05, .max = 100})
      .add(
          "micro", &o.detail.split,
          {.help = "proxy: the split by the proxy's shell, which the player draws by; a filter's "
                   "(gaussian, bilateral, guided; of depth and of intensity) is written beside it, "
                   "detail.exr of each camera"},
          {{"proxy", MicroSplit::proxy},
           {"gaussian", MicroSplit::gaussian},
           {"bilateral", MicroSplit::bilateral},
           {"guided", MicroSplit::guided}})
      .add("micro_size", &o.detail.size_mm,
           {.help = "of what a filter takes for detail, at most 32 texels",
            .unit = "mm",
            .min = 0.05,
            .max = 1000})
      .add("surface_edge", &o.surface_edge_mm,
           {.help =
                "longest edge of the coloured surface that --compare takes for truth, 0 = as it is",
            .unit = "mm",
            .min = 0,
            .max = 100})
      .add(
          "compression", &o.packing.compression,
          {.help = "of the maps; all but pxr24 are exact: it takes 0.002 mm from depths of 300 mm"},
          {{"zip", ExrCompression::zip},
           {"piz", ExrCompression::piz},
           {"pxr24", ExrCompression::pxr24},
           {"none", ExrCompression::none}})
      .add("zip_level", &o.packing.zip_level,
           {.help = "of zip; from 10 on maps are 4 % smaller and take seven times as long to write",
            .min = 1,
            .max = 12})
      .add("preset", &o.packing.compact,
           {.help = "compact: smaller maps, colour as a camera's JPEG would be, depth to 0.002 mm; "
                    "exact: as computed"},
           {{"exact", false}, {"compact", true}})
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

void bind(OptionList& list, ExportOptions& o) {
  list.add("format", &o.format,
           {.help = "gltf: proxy and cameras in metres; colmap, transforms: cameras with their "
                    "pictures; obj: the surface, as fine as the base layer, with a texture"},
           {{"gltf", ExportFormat::gltf},
            {"colmap", ExportFormat::colmap},
            {"transforms", ExportFormat::transforms},
            {"obj", ExportFormat::obj}});
}

void bind(OptionList& list, BundleOptions& o) {
  list.add("surface", &o.surface,
           {.help = "keep the coloured surface in the bundle, to compare frames with"});
}

}  // namespace organbake
