// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipelines/stage_options.h"

namespace organbake {

PlacementOptions PlaceStageOptions::resolved() const {
  PlacementOptions options = placement;
  if (cone_angle_rad > 0) options.cone = ViewingCone{cone_axis, cone_angle_rad};
  if (goal.share > 0) options.coverage = goal;
  return options;
}

void bind(OptionList& list, PlaceStageOptions& o) {
  list.add("count", &o.placement.count,
           {.help = "virtual cameras, evenly spread", .min = 1, .max = 256})
      .add("coverage", &o.goal.share,
           {.help = "instead of a count: the fewest cameras that see this share of the reachable "
                    "area, 0.5…1; 0 = go by count",
            .min = 0,
            .max = 1})
      .add("overlap", &o.goal.overlap,
           {.help = "cameras that must see it, of a coverage", .min = 1, .max = 4})
      .add("texel", &o.goal.texel_mm,
           {.help = "longest side of a texel on what counts as seen; 0 = any",
            .unit = "mm",
            .min = 0,
            .max = 1000})
      .add("view_gap", &o.goal.view_gap,
           {.help = "for a coverage, cameras are added until views miss at most this share of what "
                    "they show; 1 = never",
            .min = 0,
            .max = 1})
      .add("candidates", &o.goal.candidates,
           {.help = "directions that a coverage chooses from", .min = 16, .max = 8192})
      .add("samples", &o.goal.samples,
           {.help = "points of the surface that a coverage chooses by; where it is deeply folded "
                    "the hardest "
                    "to see of a hundred times as many",
            .min = 64,
            .max = 65536})
      .add("size", &o.placement.map_size,
           {.help = "side of the cameras' maps, which are square",
            .unit = "px",
            .min = 8,
            .max = 16384})
      .add("field_of_view", &o.placement.field_of_view_rad,
           {.help = "angle of view of each camera", .unit = "rad", .min = 0.01, .max = 2.5})
      .add("margin", &o.placement.margin,
           {.help = "free border round the organ, share of the map", .min = 0, .max = 0.4})
      .add("cone_axis", &o.cone_axis, {.help = "axis of the viewing cone, from the organ's centre"})
      .add("cone_angle", &o.cone_angle_rad,
           {.help = "half angle of the viewing cone, 1.571 = a hemisphere; 0 = cameras all round",
            .unit = "rad",
            .min = 0,
            .max = 1.571})
      .add("report", &o.report,
           {.help = "brief: coverage and texel sizes, from fewer samples; full: what views miss as "
                    "well, at rest and poked, and the surface painted by what cameras see"},
           {{"brief", CoverageDetail::brief}, {"full", CoverageDetail::full}});
  bind_unit(list, o.unit);
}

void bind(OptionList& list, CaptureStageOptions& o) {
  list.add("rays_per_texel_side", &o.capture.rays_per_texel_side,
           {.help = "n×n rays are averaged for a texel's colour; 0: 1 where it hardly changes "
                    "within a texel, or else 2",
            .min = 0,
            .max = 16})
      .add("base_step", &o.capture.base_step_mm,
           {.help = "spacing of the base layer's nodes", .unit = "mm", .min = 0.01, .max = 1000})
      .add(
          "skin_edge", &o.skin_edge_mm,
          {.help = "about how long the edges of the smooth skin are that the proxy carries; 0 = no "
                   "skin: the organ bends along the proxy's edges, as in the paper",
           .unit = "mm",
           .min = 0,
           .max = 1000})
      .add(
          "micro", &o.detail.split,
          {.help = "proxy: the split by the proxy's shell, which the player draws by; a filter's "
                   "(gaussian, bilateral, guided; of depth and of intensity) is written beside it, "
                   "detail.exr of each camera"},
          {{"proxy", MicroSplit::proxy},
           {"gaussian", MicroSplit::gaussian},
           {"bilateral", MicroSplit::bilateral},
           {"guided", MicroSplit::guided}})
      .add("micro_size", &o.detail.size_mm,
           {.help = "size of what a filter takes for detail, at most 32 texels",
            .unit = "mm",
            .min = 0.05,
            .max = 1000})
      .add("surface_edge", &o.surface_edge_mm,
           {.help =
                "longest edge of the coloured surface that --compare takes for truth, 0 = as it is",
            .unit = "mm",
            .min = 0,
            .max = 100})
      .add("compression", &o.packing.compression,
           {.help = "compression of the maps; all but pxr24 are exact: it takes 0.002 mm from "
                    "depths of 300 mm"},
           {{"zip", ExrCompression::zip},
            {"piz", ExrCompression::piz},
            {"pxr24", ExrCompression::pxr24},
            {"none", ExrCompression::none}})
      .add("zip_level", &o.packing.zip_level,
           {.help = "level of zip; from 10 on maps are 4 % smaller and take seven times as long to "
                    "write",
            .min = 1,
            .max = 12})
      .add("preset", &o.packing.compact,
           {.help = "compact: smaller maps, colour as a camera's JPEG would be, depth to 0.002 mm; "
                    "exact: as computed"},
           {{"exact", false}, {"compact", true}})
      .add("material", &o.material.tissue,
           {.help =
                "look of a surface without any colour: a tissue by name, wet and seen by the light "
                "at the scope; or plain, a matt albedo with spots"},
           {{"plain", Tissue::plain},
            {"liver", Tissue::liver},
            {"gallbladder", Tissue::gallbladder},
            {"spleen", Tissue::spleen},
            {"kidney", Tissue::kidney},
            {"stomach", Tissue::stomach},
            {"fat", Tissue::fat},
            {"silicone", Tissue::silicone}})
      .add("exemplar_mm_per_pixel", &o.exemplar_mm_per_pixel,
           {.help = "size of the exemplar's pixels on its tissue; 0 = there is no exemplar",
            .unit = "mm",
            .min = 0,
            .max = 10})
      .add("albedo", &o.material.albedo,
           {.help = "albedo of the plain material, linear RGB", .min = 0, .max = 1})
      .add("variation", &o.material.variation,
           {.help = "variation of the plain material's albedo", .min = 0, .max = 1})
      .add("feature", &o.material.feature_mm,
           {.help = "size of the plain material's largest spots",
            .unit = "mm",
            .min = 0.01,
            .max = 1000})
      .add("light_direction", &o.material.light_direction,
           {.help = "surface → light, when a material is lit"})
      .add("ambient", &o.material.ambient,
           {.help = "share of the material's light that has no direction", .min = 0, .max = 1});
  bind_unit(list, o.unit);
}

}  // namespace organbake
