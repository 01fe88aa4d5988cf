// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/core/error.h"
#include "organbake/options/options.h"
#include "organbake/pipelines/stage.h"
#include "organbake/shading/depth_maps.h"
#include "organbake/shading/frame_depth.h"
#include "organbake/shading/frame_source.h"
#include "organbake/shading/prepared_frame.h"
#include "stages/shared/options.h"

namespace organbake {

struct ShadeStageOptions {
  ShadingOptions shading;
  SelectionOptions selection;
  FrameOptions frame{.halvings = 1};
  DepthMeshOptions mesh;
  Eigen::Vector3d light_offset_mm = Eigen::Vector3d::Zero();
  double field_of_view_rad = 1.2217304763960306;  // 70°
  int sharpest = 1;
  bool strict = false;
  bool keep_light = false;  // in surface.ply's colours

  // Throws UsageError.
  void resolve();
};

inline void ShadeStageOptions::resolve() {
  if (light_offset_mm.z() != 0)
    throw UsageError(
        "light_offset_mm: its third component must be 0; the light lies beside the lens");
  shading.laparoscope.light_offset_x_mm = light_offset_mm.x();
  shading.laparoscope.light_offset_y_mm = light_offset_mm.y();
  const SelectionOptions chosen = selection_of(selection.every, sharpest);
  selection.every = chosen.every;
  selection.sharpest = chosen.sharpest;
}

inline void bind(OptionList& list, ShadeStageOptions& o) {
  list.add("model", &o.shading.model,
           {.help = "perspective camera with its light beside the lens; or the paper's method, "
                    "for a light from afar"},
           {{"laparoscope", ShadingModel::laparoscope}, {"tsai-shah", ShadingModel::tsai_shah}})
      .add(
          "light_offset_mm", &o.light_offset_mm,
          {.help = "offset of the laparoscope's light from its lens, right and down; needs a range",
           .range = {-50, 50}})
      .add("beam", &o.shading.laparoscope.beam_exponent,
           {.help = "the light falls off as cosⁿ of the angle to the axis; 0 = even",
            .range = {0, 20}})
      .add("range_mm", &o.shading.range_mm,
           {.help = "median distance of the tissue, makes depth metric; 0 = unknown; a recipe's is "
                    "motion.range_mm unless it says another",
            .range = {0, 10000},
            .as = "motion.range_mm"})
      .add("albedo_mm2", &o.shading.albedo,
           {.help = "brightness (0…1, linear) = albedo · cos / r²; makes depth metric; 0 = unknown",
            .unit = "mm²",
            .range = {0, 1e9}})
      .add("field_of_view_deg", Degrees{&o.field_of_view_rad},
           {.help = "across the frame's width when no intrinsics are given", .range = {2.9, 160.4}})
      .add("texture", &o.shading.laparoscope.texture,
           {.help = "share of brightness that is not taken for shape", .range = {1e-4, 1}})
      .add("relief", &o.shading.relief,
           {.help = "share of the relief that is kept, of a tube 1; auto: what each frame's own "
                    "evidence allows",
            .range = {0, 1}});
  bind_frames(list, o.selection.every, o.sharpest);
  list.add("halvings", &o.frame.halvings,
           {.help = "how often the frames' size is halved before anything else", .range = {0, 4}})
      .add("masks", &o.frame.masks,
           {.help = "look for the round field of view, highlights and instruments"})
      .retire("piecewise_albedo", "tissues of different colour are always told apart", true)
      .retire("iterations", "Tsai–Shah always has 20", true)
      .retire("light_deg", "Tsai–Shah's light is found in the frame")
      .retire("full_relief", "relief=1 keeps all of it", true)
      .retire("from_previous", "a frame like the one before always starts from its depth", true);
  bind_key_frame(list, o.keep_light, o.strict, o.mesh);
}

inline Stage shade_stage() {
  return {
      .name = "shade",
      .summary = "read laparoscopy frames or a video as shading: depth, normals, and a surface",
      .inputs =
          {{"frames", InputKind::frames,
            "a frame (PNG, JPEG, EXR), a folder of frames, or a video"},
           {"intrinsics", InputKind::lenses,
            "the laparoscope: calibration of OpenCV (YAML, JSON, XML), Kalibr or MATLAB (JSON), "
            "cameras.json, COLMAP folder or transforms.json; else --field-of-view-deg",
            false},
           {"instruments", InputKind::file,
            "mask of the frames' size (PNG), not black = instrument; else found by colour", false},
           {"lamp", InputKind::file,
            "lighting.json of the same endoscope, as stereo writes it: the place and beam of "
            "its lamp, instead of --light-offset-mm and --beam",
            false}},
      .outputs = {{"surface", "surface.ply"},
                  {"lighting", "lighting.json", true},
                  {"scope_photo", "photo/camera.json"},
                  {"shading", "."}},
      .make_options = make_options<ShadeStageOptions>,
      .on_request = true};
}

}  // namespace organbake
