// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipelines/stage_binding.h"
#include "pipelines/stages/mechanics/options.h"

namespace organbake {

Stage mechanics_stage() {
  return {.name = "mechanics",
          .version = 3,
          .summary = "give a proxy its springs, masses and anchors",
          .inputs = {{"proxy", InputKind::mesh, "the proxy"}},
          .outputs = {{"mechanics", "mechanics.json"}},
          .make_options = make_options<MechanicsStageOptions>,
          .single_file = true};
}

}  // namespace organbake
