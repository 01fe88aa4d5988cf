// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipelines/stage_binding.h"
#include "pipelines/stages/register/options.h"

namespace organbake {

Stage register_stage() {
  return {
      .name = "register",
      .version = 5,
      .summary = "find a photograph's pose on the surface, with a verdict",
      .inputs = {{"surface", InputKind::mesh, "the organ's surface"},
                 {.name = "photo",
                  .kind = InputKind::file,
                  .help = "photographs, PNG or JPEG, or one video: each frame starts from the last",
                  .unless = "unposed",
                  .many = true},
                 {.name = "intrinsics",
                  .kind = InputKind::lenses,
                  .help = "the lens: OpenCV calibration YAML, JSON, cameras.json, COLMAP folder or "
                          "transforms.json",
                  .unless = "unposed"},
                 {.name = "init",
                  .kind = InputKind::lenses,
                  .help = "poses to start from: pose.json, COLMAP folder or transforms.json; else "
                          "a search all round",
                  .required = false},
                 {.name = "photo_mask",
                  .kind = InputKind::file,
                  .help = "picture of the photos' size, black where they don't count",
                  .required = false,
                  .flag = "mask"},
                 {.name = "pairs",
                  .kind = InputKind::file,
                  .help = "text with lines 'x y z u v': surface points in mm and their pixels",
                  .required = false},
                 {.name = "unposed",
                  .kind = InputKind::photos,
                  .help = "instead of photos and intrinsics: a cameras.json with images",
                  .required = false}},
      .outputs = {{"photos", "pose.json"}},
      .make_options = make_options<RegisterStageOptions>,
      .single_file = true};
}

}  // namespace organbake
