// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipelines/stage_binding.h"
#include "pipelines/stages/repair/options.h"

namespace organbake {

Stage repair_stage() {
  return {.name = "repair",
          .summary = "make an outward manifold of a surface as programs export it",
          .inputs = {{"mesh", InputKind::mesh, "the surface to repair"}},
          .outputs = {{"surface", "surface.ply"}},
          .make_options = make_options<RepairStageOptions>,
          .single_file = true,
          .on_request = true};
}

}  // namespace organbake
