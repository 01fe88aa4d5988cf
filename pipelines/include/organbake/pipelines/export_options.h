// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <optional>

#include "organbake/pipelines/options.h"

namespace organbake {

inline constexpr const char* kWebPageFile = "organ.html";  // of an export for the web

// What a bundle is written as for other programs.
enum class ExportFormat { gltf, colmap, transforms, obj, usd, sofa, web };
struct ExportOptions {
  ExportFormat format = ExportFormat::gltf;
  std::size_t faces = 10000;      // of the surface; 0: all of the base layer's
  std::optional<double> texture;  // side in texels; none: 2048 for gltf and usd, as the maps else
  bool albedo = false;            // colours freed from the light that they were baked in
};

void bind(OptionList& list, ExportOptions& options);

}  // namespace organbake
