// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipelines/stage_binding.h"
#include "pipelines/stages/shade/options.h"

namespace organbake {

Stage shade_stage() {
  return {
      .name = "shade",
      .version = 4,
      .summary = "read laparoscopy frames or a video as shading: depth, normals, and a surface",
      .inputs = {{"frames", InputKind::frames,
                  "a frame (PNG, JPEG, EXR), a folder of frames, or a video"},
                 {"intrinsics", InputKind::lenses,
                  "the laparoscope: OpenCV calibration YAML, JSON, cameras.json, COLMAP folder or "
                  "transforms.json; else --field-of-view",
                  false},
                 {"instruments", InputKind::file,
                  "mask of the frames' size (PNG), not black = instrument; else found by colour",
                  false},
                 {"lamp", InputKind::file,
                  "lighting.json of the same endoscope, as stereo writes it: the place and beam of "
                  "its lamp, instead of --light-offset and --beam",
                  false}},
      .outputs = {{"surface", "surface.ply"},
                  {"lighting", "lighting.json", true},
                  {"shading", "."}},
      .make_options = make_options<ShadeStageOptions>,
      .on_request = true};
}

}  // namespace organbake
