// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipelines/stage_binding.h"
#include "pipelines/stages/stereo/options.h"

namespace organbake {

Stage stereo_stage() {
  return {
      .name = "stereo",
      .summary = "match the eyes of a stereo endoscope: metric depth, normals, and a surface",
      .inputs = {{"left", InputKind::frames,
                  "the left eye's frame (PNG, JPEG), folder of frames or video; or one file that "
                  "holds both eyes in each frame"},
                 {"right", InputKind::frames, "the right eye's", false},
                 {"calibration", InputKind::lenses,
                  "the two eyes: OpenCV stereo calibration (YAML, JSON), cameras.json of two "
                  "cameras, or a folder of texts (*left.intrinsics*, *l2r* …)"}},
      .outputs = {{"surface", "surface.ply"},
                  {"lighting", "lighting.json", true},
                  {"stereo_depth", "."}},
      .make_options = make_options<StereoStageOptions>,
      .on_request = true};
}

}  // namespace organbake
