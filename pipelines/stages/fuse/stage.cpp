// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipelines/stage_binding.h"
#include "pipelines/stages/fuse/options.h"

namespace organbake {

Stage fuse_stage() {
  return {.name = "fuse",
          .summary = "fuse depth maps from known poses into one coloured surface",
          .inputs = {{.name = "depth",
                      .kind = InputKind::frames,
                      .help = "depth maps (EXR, planar z), or folders of them as shade and stereo "
                              "write them",
                      .many = true},
                     {.name = "poses",
                      .kind = InputKind::posed,
                      .help = "the depth maps' cameras: cameras.json, COLMAP folder or "
                              "transforms.json; their images colour the surface"},
                     {.name = "pictures",
                      .kind = InputKind::frames,
                      .help = "folder of the cameras' images, when they lie elsewhere",
                      .required = false}},
          .outputs = {{"surface", "surface.ply"}},
          .make_options = make_options<FuseStageOptions>,
          .single_file = true,
          .on_request = true};
}

}  // namespace organbake
