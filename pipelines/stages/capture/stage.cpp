// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipelines/stage_binding.h"
#include "pipelines/stages/capture/options.h"

namespace organbake {

Stage capture_stage() {
  return {
      .name = "capture",
      .version = 10,
      .summary = "bake depth, colour and microstructure for each virtual camera",
      .inputs = {{"surface", InputKind::mesh, "the organ's surface"},
                 {"proxy", InputKind::mesh, "the proxy"},
                 {"cameras", InputKind::cameras, "virtual cameras, as place writes them"},
                 {.name = "photos",
                  .kind = InputKind::photos,
                  .help = "posed photographs: a cameras.json with images",
                  .required = false,
                  .made_from = "unposed"},
                 {.name = "lighting",
                  .kind = InputKind::file,
                  .help = "the light that the colours were taken in (JSON, see 'organbake schema "
                          "lighting'): the player then lights the pushed skin anew",
                  .required = false},
                 {.name = "exemplar",
                  .kind = InputKind::file,
                  .help = "photograph (PNG, JPEG) of the tissue that a surface without colours "
                          "gets; the material then gives its gloss alone",
                  .required = false},
                 {.name = "exemplar_mask",
                  .kind = InputKind::file,
                  .help = "picture of the exemplar's size, black where it is another tissue",
                  .required = false}},
      .outputs = {{"maps", "."}},
      .make_options = make_options<CaptureStageOptions>};
}

}  // namespace organbake
