// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipelines/stage_options.h"

namespace organbake {

void bind(OptionList& list, StereoStageOptions& o) {
  list.add("layout", &o.layout,
           {.help = "where the eyes lie in one file, the left one first; auto: seen from its first "
                    "frame"},
           {{"auto", StereoLayout::none},
            {"side-by-side", StereoLayout::side_by_side},
            {"top-bottom", StereoLayout::top_bottom}})
      .add("swap_eyes", &o.swap_eyes, {.help = "the right eye's picture comes first"});
  bind_unit(list, o.unit, "unit of the calibration's lengths");
  list.add("nearest", &o.stereo.nearest_mm,
           {.help = "that tissue comes to the lens", .unit = "mm", .min = 1, .max = 10000})
      .add("farthest", &o.stereo.farthest_mm,
           {.help = "that tissue is from the lens", .unit = "mm", .min = 2, .max = 100000})
      .add("reach", &o.stereo.reach,
           {.help = "gaps are closed over this share of the picture's width, where the surface "
                    "around them is smooth; 0 = none is",
            .min = 0,
            .max = 0.2})
      .add("masks", &o.masks,
           {.help = "look for the round field of view, highlights and instruments"});
  bind_frames(list, o.every, o.sharpest);
  bind_key_frame(list, o.keep_light, o.strict, o.mesh_frame, o.mesh);
}

void bind(OptionList& list, FuseStageOptions& options) {
  FusionOptions& o = options.fusion;
  list.add("voxel", &o.voxel_mm,
           {.help = "side of the volume's voxels; 0 = as fine as the depth maps' pixels",
            .unit = "mm",
            .min = 0,
            .max = 50})
      .add("truncation", &o.truncation_mm,
           {.help = "how far from the surface distances count; 0 = by the noise",
            .unit = "mm",
            .min = 0,
            .max = 200})
      .add("holes", &o.holes,
           {.help = "open: no surface where nothing was seen; closed: what was not seen is inside"},
           {{"open", Holes::open}, {"closed", Holes::closed}})
      .add("light", &o.light,
           {.help =
                "light of the pictures: camera = a lamp at the lens, divided out of the colours; "
                "any = they stay as they are"},
           {{"any", PictureLight::any}, {"camera", PictureLight::camera}})
      .add("refine", &o.refine, {.help = "move the cameras so that the depth maps agree"})
      .add("place", &o.off.place_mm,
           {.help = "how far off the cameras may be, standard deviation; for refine",
            .unit = "mm",
            .min = 0.001,
            .max = 50})
      .add("angle", &o.off.angle_rad,
           {.help = "how much turned the cameras may be, standard deviation; for refine",
            .unit = "rad",
            .min = 1e-5,
            .max = 0.5})
      .add("largest", &o.largest,
           {.help = "pieces of largest area that are kept; 0 = all", .min = 0, .max = 1000000});
  bind_unit(list, options.unit, "unit of the depth maps");
}

}  // namespace organbake
