// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/formats/mesh_files.h"
#include "organbake/fusion/fuse_views.h"
#include "organbake/options/options.h"
#include "organbake/pipelines/stage.h"
#include "stages/shared/options.h"

namespace organbake {

struct FuseStageOptions {
  FusionOptions fusion;
  MeshUnit unit = MeshUnit::mm;  // of the depths
};

inline void bind(OptionList& list, FuseStageOptions& options) {
  FusionOptions& o = options.fusion;
  list.add("voxel_mm", &o.voxel_mm,
           {.help = "side of the volume's voxels; 0 = as fine as the depth maps' pixels",
            .range = {0, 50}})
      .add("holes", &o.holes,
           {.help = "open: no surface where nothing was seen; closed: what was not seen is inside"},
           {{"open", Holes::open}, {"closed", Holes::closed}})
      .add("light", &o.light,
           {.help =
                "light of the pictures: camera = a lamp at the lens, divided out of the colours; "
                "any = they stay as they are"},
           {{"any", PictureLight::any}, {"camera", PictureLight::camera}})
      .add("scale", &o.scale,
           {.help = "between depths and poses: auto = one where the depths are relative, or agree "
                    "far better by it; given = they are in one unit; one = one scale for all maps; "
                    "each = one for each map"},
           {{"auto", DepthScale::automatic},
            {"given", DepthScale::given},
            {"one", DepthScale::one},
            {"each", DepthScale::each}})
      .add("refine", &o.refine, {.help = "move the cameras so that the depth maps agree"})
      .add("largest", &o.largest,
           {.help = "pieces of largest area that are kept; 0 = all", .range = {0, 1000000}})
      .retire("truncation_mm", "it follows the depths' noise")
      .retire("color_mm", "faces are as the voxels have them")
      .retire("place_mm", "refine takes the poses for good to 1 mm")
      .retire("angle_deg", "refine takes the poses for good to a degree");
  bind_unit(list, options.unit, "unit of the depth maps");
}

inline Stage fuse_stage() {
  return {.name = "fuse",
          .summary = "fuse depth maps from known poses into one coloured surface",
          .inputs = {{.name = "depth",
                      .kind = InputKind::frames,
                      .help = "depth maps (EXR, planar z), or folders of them as shade and stereo "
                              "write them",
                      .many = true},
                     {.name = "poses",
                      .kind = InputKind::posed,
                      .help = "the cameras of the depth maps' frames, found by name or number: "
                              "cameras.json, COLMAP folder or transforms.json; their images "
                              "colour the surface"},
                     {.name = "pictures",
                      .kind = InputKind::frames,
                      .help = "folder of the cameras' images, when they lie elsewhere",
                      .required = false}},
          .outputs = {{"surface", "surface.ply"}},
          .make_options = make_options<FuseStageOptions>,
          .single_file = true,
          .on_request = true};
}

}  // namespace organbake
