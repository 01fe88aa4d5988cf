// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <vector>

#include "measuring/measurement.h"

namespace organbake {

// A baked bundle of a surface in a material's colours, against the surface that went in:
//   pictures (16:9, of a height in px) of three views between the cameras, RMS over both
//   silhouettes, levels of 255; the surface's vertices projected in one of them, mean px,
//   image-based and by polygons; the surface's vertices to the proxy, RMS in mm.
// The picture's truth is the surface traced in the same material (material_picture.h). Throws
// BadDataError for a bundle without its surface.
Quantities bundle_errors(const std::filesystem::path& bundle, int height_px);

}  // namespace organbake
