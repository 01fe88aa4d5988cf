// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/bundle/stored_maps.h"
#include "organbake/capture/capture.h"
#include "organbake/formats/mesh_files.h"
#include "organbake/options/options.h"
#include "organbake/pipelines/stage.h"
#include "stages/shared/options.h"

namespace organbake {

struct CaptureStageOptions {
  CaptureOptions capture;
  double surface_edge_mm = 0;  // of the coloured surface; 0 = as it came
  double skin_edge_mm = 6;     // of the smooth skin over the proxy; 0 = none
  Material material;
  double exemplar_mm_per_pixel = 0;  // of the exemplar's pixels on its tissue; 0: there is none
  MapPacking packing;
  MeshFrame frame;
};

inline void bind(OptionList& list, CaptureStageOptions& o) {
  list.add("rays_per_texel_side", &o.capture.rays_per_texel_side,
           {.help = "n×n rays are averaged for a texel's colour; 0: 1 where it hardly changes "
                    "within a texel, or else 2",
            .range = {0, 16}})
      .add("base_step_mm", &o.capture.base_step_mm,
           {.help = "spacing of the base layer's nodes", .range = {0.01, 1000}})
      .add(
          "skin_edge_mm", &o.skin_edge_mm,
          {.help = "about how long the edges of the smooth skin are that the proxy carries; 0 = no "
                   "skin: the organ bends along the proxy's edges, as in the paper",
           .range = {0, 1000}})
      .add("surface_edge_mm", &o.surface_edge_mm,
           {.help =
                "longest edge of the coloured surface that --compare takes for truth, 0 = as it is",
            .range = {0, 100}})
      .add("compression", &o.packing.compression,
           {.help = "compression of the maps; all but pxr24 are exact: it takes 0.002 mm from "
                    "depths of 300 mm"},
           {{"zip", ExrCompression::zip},
            {"piz", ExrCompression::piz},
            {"pxr24", ExrCompression::pxr24},
            {"none", ExrCompression::none}})
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
            {"bowel", Tissue::bowel},
            {"fat", Tissue::fat},
            {"silicone", Tissue::silicone}})
      .add("exemplar_mm_per_pixel", &o.exemplar_mm_per_pixel,
           {.help = "size of the exemplar's pixels on its tissue; 0 = there is no exemplar",
            .unit = "mm",
            .range = {0, 10}})
      .add("albedo", &o.material.albedo,
           {.help = "albedo of the plain material, linear RGB", .range = {0, 1}})
      .add("feature_mm", &o.material.feature_mm,
           {.help = "size of the plain material's largest spots", .range = {0.01, 1000}})
      .retire("micro", "microstructure is what stands out of the proxy's shell")
      .retire("micro_size_mm", "microstructure is what stands out of the proxy's shell")
      .retire("zip_level", "it is always 6")
      .retire("variation", "a plain albedo always varies by a quarter")
      .retire("light_direction", "a plain material is lit from above the front")
      .retire("ambient", "a third of its light comes from all around");
  bind(list, o.frame);
}

inline Stage capture_stage() {
  return {
      .name = "capture",
      .summary = "bake depth, colour and microstructure for each virtual camera",
      .inputs = {{"surface", InputKind::mesh, "the organ's surface"},
                 {"proxy", InputKind::mesh, "the proxy"},
                 {"cameras", InputKind::cameras, "virtual cameras, as place writes them"},
                 {.name = "photos",
                  .kind = InputKind::photos,
                  .help = "posed photographs: a cameras.json with images",
                  .required = false,
                  .made_from = "unposed"},
                 {.name = "scope_photo",
                  .kind = InputKind::photos,
                  .help = "the posed picture that the surface was read from, as shade and stereo "
                          "write it; where there are no photos",
                  .required = false},
                 {.name = "lighting",
                  .kind = InputKind::file,
                  .help = "the light that the colours were taken in (JSON, see 'organbake schema "
                          "lighting'): the player then lights the pushed skin anew",
                  .required = false},
                 {.name = "breath",
                  .kind = InputKind::file,
                  .help = "how the tissue breathes, breath_field.json as motion writes it: it "
                          "becomes a script that moves the proxy, breath.json",
                  .required = false},
                 {.name = "exemplar",
                  .kind = InputKind::file,
                  .help = "photograph (PNG, JPEG) of the tissue that a surface without colours "
                          "gets; the material then gives its gloss alone",
                  .required = false},
                 {.name = "exemplar_mask",
                  .kind = InputKind::file,
                  .help = "picture of the exemplar's size, black where it is another tissue",
                  .required = false}},
      .outputs = {{"maps", "."}},
      .make_options = make_options<CaptureStageOptions>};
}

}  // namespace organbake
