// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/motion/clip_spans.h"
#include "organbake/options/options.h"
#include "organbake/pipelines/stage.h"

namespace organbake {

struct SpansStageOptions {
  SpanOptions search;
  double samples_per_s = 3;
  int best = 3;
};

inline void bind(OptionList& list, SpansStageOptions& o) {
  list.add("best", &o.best,
           {.help = "spans that are chosen, those first by which most can be told; a batch bakes "
                    "each of them",
            .range = {1, 1000}})
      .add("samples_per_s", &o.samples_per_s,
           {.help = "pictures that are looked at in a second of the video", .range = {1, 25}})
      .add("shortest_s", &o.search.shortest_s,
           {.help = "shorter spans are not worth baking", .range = {0.5, 60}})
      .add("longest_s", &o.search.longest_s,
           {.help = "longer spans are cut into several", .range = {1, 600}});
}

inline Stage spans_stage() {
  return {.name = "spans",
          .summary =
              "find the spans of a long video in which a scope moves over steady tissue, "
              "which are worth baking by motion",
          .inputs = {{"frames", InputKind::frames, "a video, or a folder of frames"}},
          .outputs = {{"spans", "spans.csv"}},
          .make_options = make_options<SpansStageOptions>,
          .single_file = true,
          .on_request = true,
          .by_section_only = true};
}

}  // namespace organbake
