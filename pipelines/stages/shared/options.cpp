// SPDX-License-Identifier: GPL-3.0-or-later
// Options that several stages have: how volumes, meshes and clips are read.
#include "stages/shared/options.h"

#include "organbake/core/error.h"
#include "organbake/formats/mesh_files.h"
#include "organbake/shading/depth_maps.h"
#include "organbake/shading/frame_source.h"
#include "stages/shared/volume_options.h"

namespace organbake {

void bind(OptionList& list, ReadStageOptions& o) {
  list.add("series", &o.series,
           {.help =
                "series of a DICOM folder, by its UID or number; else the one that is a CT volume",
            .number_too = true})
      .add("time", &o.time,
           {.help = "time point of a 4-D file or series, from 1; 0 = it has only one",
            .range = {0, 1000000}})
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

SelectionOptions selection_of(int every, int sharpest) {
  if (every > 1 && sharpest > 1)
    throw UsageError("give either every or sharpest: both say which frames are taken");
  return {.every = sharpest > 1 ? sharpest : every, .sharpest = sharpest > 1};
}

void bind_frames(OptionList& list, int& every, int& sharpest) {
  list.add("every", &every, {.help = "take one frame in N", .range = {1, 1000000}})
      .add("sharpest", &sharpest,
           {.help = "take the sharpest frame of each K", .range = {1, 100000}});
}

void bind_key_frame(OptionList& list, bool& keep_light, bool& strict, DepthMeshOptions& mesh) {
  list.add("keep_light", &keep_light,
           {.help = "leave the scope's light and its highlights in the surface's colours; else "
                    "they are divided out, and the player lights the tissue anew"})
      .add("strict", &strict, {.help = "exit code 3 unless every frame's verdict is ok"})
      .add("mesh_step_px", &mesh.step_px, {.help = "step of the surface's grid", .range = {1, 64}})
      .add("tear", &mesh.tear,
           {.help = "neighbours whose depths differ by a larger share are not joined",
            .range = {1e-4, 1}})
      .retire("mesh_frame", "the most confident frame becomes the surface; give one frame for its");
}

}  // namespace organbake
