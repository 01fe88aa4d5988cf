// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipelines/stage_binding.h"
#include "pipelines/stages/phantom/options.h"

namespace organbake {

Stage phantom_stage() {
  return {.name = "phantom",
          .version = 2,
          .summary = "make a synthetic organ: CT, photographs, and the truth about both",
          .inputs = {},
          .outputs = {{"ct", "ct.mha"},
                      {"photos", "photos/cameras.json"},
                      {"lighting", "photos/lighting.json"},
                      {"truth", "truth.ply"}},
          .make_options = make_options<PhantomStageOptions>};
}

}  // namespace organbake
