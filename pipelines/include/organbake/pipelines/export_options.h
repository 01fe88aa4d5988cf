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

void bind(OptionList& list, ExportOptions& options);

}  // namespace organbake
