// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipelines/stage_binding.h"
#include "pipelines/stages/decimate/options.h"

namespace organbake {

Stage decimate_stage() {
  return {.name = "decimate",
          .version = 4,
          .summary = "reduce a surface to the coarse proxy that the player deforms",
          .inputs = {{"surface", InputKind::mesh, "the organ's surface"}},
          .outputs = {{"proxy", "proxy.ply"}},
          .make_options = make_options<DecimateStageOptions>,
          .single_file = true};
}

}  // namespace organbake
