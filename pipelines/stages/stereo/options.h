// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/formats/mesh_files.h"
#include "organbake/options/options.h"
#include "organbake/pipelines/stage.h"
#include "organbake/shading/depth_maps.h"
#include "organbake/shading/prepared_frame.h"
#include "organbake/stereo/stereo_depth.h"
#include "stages/shared/options.h"

namespace organbake {

struct StereoStageOptions {
  StereoOptions stereo;
  DepthMeshOptions mesh;
  StereoLayout layout = StereoLayout::none;  // none = seen from the first frame
  bool swap_eyes = false;
  bool masks = true;
  int every = 1, sharpest = 1;
  MeshUnit unit = MeshUnit::mm;
  bool strict = false;
  bool keep_light = false;  // in surface.ply's colours
};

inline void bind(OptionList& list, StereoStageOptions& o) {
  list.add("layout", &o.layout,
           {.help = "where the eyes lie in one file, the left one first; auto: seen from its first "
                    "frame"},
           {{"auto", StereoLayout::none},
            {"side-by-side", StereoLayout::side_by_side},
            {"top-bottom", StereoLayout::top_bottom}})
      .add("swap_eyes", &o.swap_eyes, {.help = "the right eye's picture comes first"});
  bind_unit(list, o.unit, "unit of the calibration's lengths");
  list.add("nearest_mm", &o.stereo.nearest_mm,
           {.help = "that tissue comes to the lens", .range = {1, 10000}})
      .add("farthest_mm", &o.stereo.farthest_mm,
           {.help = "that tissue is from the lens", .range = {2, 100000}})
      .add("reach", &o.stereo.reach,
           {.help = "gaps up to this share of the picture's width are closed, where the surface "
                    "around them is smooth; 0 = none is",
            .range = {0, 0.2}})
      .add("masks", &o.masks,
           {.help = "look for the round field of view, highlights and instruments"});
  bind_frames(list, o.every, o.sharpest);
  bind_key_frame(list, o.keep_light, o.strict, o.mesh);
}

inline Stage stereo_stage() {
  return {
      .name = "stereo",
      .summary = "match the eyes of a stereo endoscope: metric depth, normals, and a surface",
      .inputs = {{"left", InputKind::frames,
                  "the left eye's frame (PNG, JPEG), folder of frames or video; or one file that "
                  "holds both eyes in each frame"},
                 {"right", InputKind::frames, "the right eye's", false},
                 {"calibration", InputKind::lenses,
                  "the two eyes: stereo calibration of OpenCV (YAML, JSON, XML), Kalibr, MATLAB "
                  "(JSON) or StereoMIS (.ini), cameras.json of two cameras, or a folder of texts "
                  "(*left.intrinsics*, *l2r* …)"}},
      .outputs = {{"surface", "surface.ply"},
                  {"lighting", "lighting.json", true},
                  {"scope_photo", "photo/camera.json"},
                  {"scope_depth", "."}},
      .make_options = make_options<StereoStageOptions>,
      .on_request = true};
}

}  // namespace organbake
