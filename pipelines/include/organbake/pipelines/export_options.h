// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>

#include "organbake/options/options.h"

namespace organbake {

inline constexpr const char* kWebPageFile = "organ.html";  // of an export for the web

// What a bundle is written as for other programs.
enum class ExportFormat { gltf, colmap, transforms, obj, usd, sofa, mjcf, gmsh, web };
struct ExportOptions {
  ExportFormat format = ExportFormat::gltf;
  std::size_t faces = 10000;      // of the surface; 0: all of the base layer's
  std::optional<double> texture;  // side in texels; none: 2048 for gltf and usd, as the maps else
  bool albedo = false;            // colours freed from the light that they were baked in
  bool vendor_names = false;      // of usd: Omniverse's schemas beside the proposal's
  std::filesystem::path interaction;  // of usd: a script, whose motion becomes time samples
};

inline void bind(OptionList& list, ExportOptions& o) {
  list.add(
      "format", &o.format,
      {.help = "gltf, obj: the surface with colours and normals as textures, in metres, y up; "
               "colmap, transforms: cameras with pictures, masks, depth and points, in "
               "millimetres, LPS; usd, sofa: for physics engines, with masses, springs and "
               "tetrahedra, in metres, y up; mjcf: the tetrahedra as a flex of MuJoCo, in metres, "
               "LPS; gmsh: the tetrahedra alone, in millimetres, LPS; web: one page in which "
               "anyone can poke the organ"},
      {{"gltf", ExportFormat::gltf},
       {"colmap", ExportFormat::colmap},
       {"transforms", ExportFormat::transforms},
       {"obj", ExportFormat::obj},
       {"usd", ExportFormat::usd},
       {"sofa", ExportFormat::sofa},
       {"mjcf", ExportFormat::mjcf},
       {"gmsh", ExportFormat::gmsh},
       {"web", ExportFormat::web}});
  list.add("faces", &o.faces,
           {.help = "for formats with a surface, its most faces; 0 = all of the base layer's",
            .range = {0, 10'000'000}});
  list.add("texture_px", &o.texture,
           {.help = "for formats with a surface, the side of its texture; auto: 2048 for gltf and "
                    "usd, as fine as the maps for obj and sofa",
            .range = {64, 8192}});
  list.add(
      "albedo", &o.albedo,
      {.help = "for formats with a surface, colours without the light that they were baked in, for "
               "viewers that light anew; else as organplay shows them with --light baked"});
  list.add("vendor_names", &o.vendor_names,
           {.help = "for usd, also the schemas of Omniverse (OmniPhysics…) beside those of the "
                    "proposal for UsdPhysics"});
  list.add("interaction", &o.interaction,
           {.help = "for usd, a script (organplay --script) without blades, played by the "
                    "tetrahedra where there are any; its motion becomes time samples"});
}

// Of the sheet of materials that the module `swatches` draws.
struct SwatchOptions {
  int columns = 3;
  int side_px = 320;  // of one swatch
};

inline constexpr const char* kSwatchFile = "swatches.png";

}  // namespace organbake
