// SPDX-License-Identifier: GPL-3.0-or-later
#include "stages/shared/reading_options.h"

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
      .add("roi_mm", &o.roi,
           {.help = "two corners x0,y0,z0,x1,y1,z1 of the box that is read; else all",
            .unit = "mm, LPS"})
      .add("unit_affine", &o.unit_affine,
           {.help = "of a NIfTI affine in steps of 1 mm whose header tells other voxel sizes: "
                    "refuse it, keep its steps, or scale them to those sizes"},
           {{"refuse", UnitAffine::refuse},
            {"keep", UnitAffine::keep},
            {"scale", UnitAffine::scale}});
}

void bind(OptionList& list, MeshFrame& frame) {
  std::vector<std::pair<std::string, std::optional<MeshUnit>>> units = {{"auto", std::nullopt}};
  for (const UnitName& known : kMeshUnits) units.emplace_back(known.name, known.unit);
  std::vector<std::pair<std::string, std::optional<MeshSpace>>> spaces = {{"auto", std::nullopt}};
  for (const SpaceName& known : kMeshSpaces) spaces.emplace_back(known.name, known.space);
  list.add("unit", &frame.unit,
           {.help = "of a mesh file that doesn't say its own; auto: mm, of glTF m"}, units)
      .add(
          "space", &frame.space,
          {.help = "axes of a mesh file that doesn't say its own; auto: LPS, of glTF y-up (x left, "
                   "y superior, z anterior)"},
          spaces);
}

void bind_unit(OptionList& list, MeshUnit& unit, const char* help) {
  std::vector<std::pair<std::string, MeshUnit>> units;
  for (const UnitName& known : kMeshUnits) units.emplace_back(known.name, known.unit);
  list.add("unit", &unit, {.help = help}, units);
}

}  // namespace organbake
