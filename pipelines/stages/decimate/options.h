// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>

#include "organbake/decimate/decimate.h"
#include "organbake/formats/mesh_files.h"
#include "organbake/options/options.h"
#include "organbake/pipelines/stage.h"
#include "stages/shared/options.h"

namespace organbake {

struct DecimateStageOptions {
  DecimateOptions decimate;          // but for its faces
  std::optional<double> faces = 80;  // none: as many as a tool can dent and shape needs
  double tool_radius_mm = 5;         // of that tool's tip
  MeshFrame frame;
};

inline void bind(OptionList& list, DecimateStageOptions& options) {
  DecimateOptions& o = options.decimate;
  list.add(
          "faces", &options.faces,
          {.help =
               "the proxy has at most this many; auto: as many as a tip of tool_radius can dent, "
               "and "
               "more until the proxy lies off by 5 % of the organ's thickness at most (vessels' of "
               "their own), up to 6000",
           .range = {4, 10000000}})
      .add("tool_radius_mm", &options.tool_radius_mm,
           {.help = "radius of the tip that faces = auto makes the proxy for", .range = {0.5, 100}})
      .add("method", &o.method,
           {.help = "edge collapse and a fit to the surface; or plain collapses alone, in a "
                    "fraction of the time"},
           {{"fitted", DecimateMethod::fitted},
            {"lindstrom-turk", DecimateMethod::lindstrom_turk},
            {"quadric", DecimateMethod::quadric}})
      .add("flips", &o.flips,
           {.help = "let the fit flip edges where that lowers the distance, up to 500 faces"})
      .retire("objective", "the fit lowers the RMS distance; faces = auto bounds the largest")
      .retire("max_error_mm", "faces = auto takes as many as 5 % of the thickness asks for");
  bind(list, options.frame);
}

inline Stage decimate_stage() {
  return {.name = "decimate",
          .summary = "reduce a surface to the coarse proxy that the player deforms",
          .inputs = {{"surface", InputKind::mesh, "the organ's surface"}},
          .outputs = {{"proxy", "proxy.ply"}},
          .make_options = make_options<DecimateStageOptions>,
          .single_file = true};
}

}  // namespace organbake
