// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipelines/stages/shared/reading_options.h"

namespace organbake {

void bind(OptionList& list, ReadStageOptions& o) {
  list.add("series", &o.series,
           {.help =
                "series of a DICOM folder, by its UID or number; else the one that is a CT volume",
            .number_too = true})
      .add("time", &o.time,
           {.help = "time point of a 4-D file or series, from 1; 0 = it has only one",
            .min = 0,
            .max = 1000000})
      .add(
          "strict", &o.strict,
          {.help = "refuse a DICOM series with uneven, missing, repeated or damaged slices instead "
                   "of mending it"})
      .add("roi", &o.roi,
           {.help = "two corners x0,y0,z0,x1,y1,z1 of the box that is read; else all",
            .unit = "mm, LPS"});
}

void bind_unit(OptionList& list, MeshUnit& unit, const char* help) {
  list.add(
      "unit", &unit, {.help = help},
      {{"mm", MeshUnit::mm}, {"cm", MeshUnit::cm}, {"m", MeshUnit::m}, {"in", MeshUnit::inch}});
}

}  // namespace organbake
