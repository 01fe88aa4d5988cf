// SPDX-License-Identifier: GPL-3.0-or-later
#include "stages/shared/clip_options.h"

#include "organbake/core/error.h"

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
      .add("mesh_step_px", &mesh.step_px,
           {.help = "step of the surface's grid", .unit = "px", .min = 1, .max = 64})
      .add("tear", &mesh.tear,
           {.help = "neighbours whose depths differ by a larger share are not joined",
            .min = 1e-4,
            .max = 1});
}

}  // namespace organbake
