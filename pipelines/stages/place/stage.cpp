// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipelines/stage_binding.h"
#include "pipelines/stages/place/options.h"

namespace organbake {

Stage place_stage() {
  return {.name = "place",
          .version = 6,
          .summary = "place virtual cameras round a surface or inside a viewing cone",
          .inputs = {{"surface", InputKind::mesh, "the organ's surface"}},
          .outputs = {{"cameras", "cameras.json"}, {"vpm", "vpm.ply"}},
          .make_options = make_options<PlaceStageOptions>};
}

}  // namespace organbake
