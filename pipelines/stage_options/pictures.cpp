// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipelines/stage_options.h"

#include <cmath>
#include <cstdio>

#include "core/error.h"

namespace organbake {

SelectionOptions selection_of(int every, int sharpest) {
  if (every > 1 && sharpest > 1)
    throw UsageError("give either every or sharpest: both say which frames are taken");
  return {.every = sharpest > 1 ? sharpest : every, .sharpest = sharpest > 1};
}

void bind_frames(OptionList& list, int& every, int& sharpest) {
  list.add("every", &every, {.help = "take one frame in N", .min = 1, .max = 1000000})
      .add("sharpest", &sharpest,
           {.help = "take the sharpest frame of each K", .min = 1, .max = 100000});
}

void bind_key_frame(OptionList& list, bool& keep_light, bool& strict, int& mesh_frame,
                    DepthMeshOptions& mesh) {
  list.add("keep_light", &keep_light,
           {.help = "leave the scope's light and its highlights in the surface's colours; else "
                    "they are divided out, and the player lights the tissue anew"})
      .add("strict", &strict, {.help = "exit code 3 unless every frame's verdict is ok"})
      .add("mesh_frame", &mesh_frame,
           {.help = "frame of the clip that becomes surface.ply; -1 = the most confident",
            .min = -1,
            .max = 100000000})
      .add("mesh_step", &mesh.step_px,
           {.help = "step of the surface's grid", .unit = "px", .min = 1, .max = 64})
      .add("tear", &mesh.tear,
           {.help = "neighbours whose depths differ by a larger share are not joined",
            .min = 1e-4,
            .max = 1});
}

void ShadeStageOptions::resolve() {
  if (light_offset_mm.z() != 0)
    throw UsageError("light_offset: its third component must be 0; the light lies beside the lens");
  shading.laparoscope.light_offset_x_mm = light_offset_mm.x();
  shading.laparoscope.light_offset_y_mm = light_offset_mm.y();
  const SelectionOptions chosen = selection_of(selection.every, sharpest);
  selection.every = chosen.every;
  selection.sharpest = chosen.sharpest;
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
           {.help = "direction of a distant model's light: auto, or tilt,slant (0 = right, turning "
                    "down)",
            .unit = "rad"})
      .add(
          "light_offset", &o.light_offset_mm,
          {.help = "offset of the laparoscope's light from its lens, right and down; needs a range",
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
      .add("iterations", &o.shading.iterations,
           {.help = "iterations of Tsai–Shah", .min = 1, .max = 1000000});
  bind_frames(list, o.selection.every, o.sharpest);
  list.add(
          "halvings", &o.frame.halvings,
          {.help = "how often the frames' size is halved before anything else", .min = 0, .max = 4})
      .add("masks", &o.frame.masks,
           {.help = "look for the round field of view, highlights and instruments"})
      .add("piecewise_albedo", &o.frame.piecewise_albedo,
           {.help = "bring tissues of different colour to one albedo"})
      .add("from_previous", &o.from_previous,
           {.help = "a frame like the one before starts from its depth"})
      .add("full_relief", &o.shading.full_relief,
           {.help =
                "keep all relief, also where the picture does not support it (verdict doubtful); "
                "else depth there is near flat"});
  bind_key_frame(list, o.keep_light, o.strict, o.mesh_frame, o.mesh);
}

void bind(OptionList& list, RegisterStageOptions& o) {
  RegistrationOptions& r = o.registration;
  list.add(
          "light", &r.light,
          {.help = "where the light is: at the camera; near it, with a beam of its own; in "
                   "light_direction; anywhere, estimated with the pose; auto: what the photo says"},
          {{"auto", LightModel::automatic},
           {"camera", LightModel::camera},
           {"beam", LightModel::beam},
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
      .add("closed_outline", &o.closed_outline,
           {.help = "the organ ends where the mesh has a border; else it goes on there, unseen"})
      .add("vertex_albedo", &o.vertex_albedo,
           {.help = "take the surface's vertex colours for its albedo"})
      .add("from_poses", &o.from_poses,
           {.help = "start unposed photos from the poses in their document"})
      .add("finest_side", &r.finest_side_px,
           {.help = "a photo is halved until no side is longer",
            .unit = "px",
            .min = 64,
            .max = 8192})
      .add("outer_iterations", &r.outer_iterations,
           {.help = "per pyramid level: overlap, light and weights anew", .min = 1, .max = 50})
      .add("solver_iterations", &r.solver_iterations,
           {.help = "iterations of the solver within each of those", .min = 1, .max = 100})
      .add("also", &o.also, {.help = "write the cameras for other programs as well"},
           {{"none", CameraExport::none},
            {"colmap", CameraExport::colmap},
            {"transforms", CameraExport::transforms}});
  bind_unit(list, o.unit);
}

}  // namespace organbake
