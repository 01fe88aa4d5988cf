// SPDX-License-Identifier: GPL-3.0-or-later
#include "stages/fuse/options.h"

#include "organbake/pipelines/stage_binding.h"
#include "stages/shared/reading_options.h"

namespace organbake {

void bind(OptionList& list, FuseStageOptions& options) {
  FusionOptions& o = options.fusion;
  list.add("voxel_mm", &o.voxel_mm,
           {.help = "side of the volume's voxels; 0 = as fine as the depth maps' pixels",
            .unit = "mm",
            .min = 0,
            .max = 50})
      .add("truncation_mm", &o.truncation_mm,
           {.help = "how far from the surface distances count; 0 = by the noise",
            .unit = "mm",
            .min = 0,
            .max = 200})
      .add("color_mm", &o.color_mm,
           {.help = "longest edge of the surface's faces, so that its colours are as fine as the "
                    "pictures; 0 = as the voxels have it",
            .unit = "mm",
            .min = 0,
            .max = 50})
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
      .add("place_mm", &o.off.place_mm,
           {.help = "how far off the cameras may be, standard deviation; for refine",
            .unit = "mm",
            .min = 0.001,
            .max = 50})
      .add("angle_deg", Degrees{&o.off.angle_rad},
           {.help = "how much turned the cameras may be, standard deviation; for refine",
            .unit = "deg",
            .min = 0.0005,
            .max = 30})
      .add("largest", &o.largest,
           {.help = "pieces of largest area that are kept; 0 = all", .min = 0, .max = 1000000});
  bind_unit(list, options.unit, "unit of the depth maps");
}

Stage fuse_stage() {
  return {.name = "fuse",
          .version = 3,
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
