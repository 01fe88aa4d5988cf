// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "organbake/formats/mesh_files.h"
#include "organbake/options/options.h"
#include "organbake/pipelines/stage.h"
#include "organbake/repair/repair.h"
#include "stages/shared/options.h"

namespace organbake {

struct RepairStageOptions {
  std::string mode = "auto";  // or none: the surface as it is
  RepairOptions repair;
  MeshFrame frame;
};

inline void bind(OptionList& list, RepairStageOptions& options) {
  RepairOptions& o = options.repair;
  list.add("mode", &options.mode,
           {.help = "auto: what it needs; none: the surface as it is", .choices = {"auto", "none"}})
      .add(
          "island_share", &o.island_share,
          {.help = "pieces of less than this share of the largest one's area are dropped; 0 = none",
           .range = {0, 0.999}})
      .add("hole_mm", &o.hole_mm,
           {.help = "holes up to this width are closed; 0 = a tenth of the surface's size",
            .range = {0, 1e6}})
      .add("wrap_mm", &o.wrap_mm,
           {.help = "what a wrap closes, gaps and tunnels; 0 = a hundredth of the surface's size",
            .range = {0, 1e6}})
      .add("volume_change", &o.volume_change,
           {.help = "a repair that changes the volume by more than this share is refused",
            .range = {0, 1e6}})
      .retire("tunnels", "a surface with more than 4 is wrapped");
  bind(list, options.frame);
}

inline Stage repair_stage() {
  return {.name = "repair",
          .summary = "make an outward manifold of a surface as programs export it",
          .inputs = {{"mesh", InputKind::mesh, "the surface to repair"}},
          .outputs = {{"surface", "surface.ply"}},
          .make_options = make_options<RepairStageOptions>,
          .single_file = true,
          .on_request = true};
}

}  // namespace organbake
