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
      .add("max_error_mm", &o.max_error_mm,
           {.help = "fewest faces within this distance both ways, measured; 0 = go by faces",
            .range = {0, 1e9}})
      .add("method", &o.method,
           {.help = "edge collapse and a fit to the surface; draft, for a first look in a "
                    "fraction of the time; or, to compare, plain collapses or the paper's naive "
                    "clustering"},
           {{"fitted", DecimateMethod::fitted},
            {"draft", DecimateMethod::draft},
            {"lindstrom-turk", DecimateMethod::lindstrom_turk},
            {"quadric", DecimateMethod::quadric},
            {"cluster", DecimateMethod::cluster}})
      .add("objective", &o.objective,
           {.help = "what the fit lowers: the RMS distance with the volume kept, or the largest "
                    "distance"},
           {{"rms", DecimateObjective::rms}, {"max", DecimateObjective::max}})
      .add("flips", &o.flips,
           {.help = "let the fit flip edges where that lowers the distance, up to 500 faces"});
  bind(list, options.frame);
}

inline Stage decimate_stage() {
  return {.name = "decimate",
          .version = 8,
          .summary = "reduce a surface to the coarse proxy that the player deforms",
          .inputs = {{"surface", InputKind::mesh, "the organ's surface"}},
          .outputs = {{"proxy", "proxy.ply"}},
          .make_options = make_options<DecimateStageOptions>,
          .single_file = true};
}

}  // namespace organbake
