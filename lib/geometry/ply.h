// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>

#include "geometry/triangle_mesh.h"

namespace organbake {

// Triangle PLY, ASCII or binary little-endian; polygons are fanned. Coordinates float or double;
// colours red/green/blue as uchar (sRGB) or float (linear). Throws NoInputError or BadDataError;
// counts are checked against the file's size before memory is taken.
TriangleMesh read_ply(const std::filesystem::path& path);
TriangleMesh parse_ply(std::span<const std::byte> bytes, const std::string& name);

// Binary little-endian: double x y z, float red green blue (linear) when the mesh has colours.
void write_ply(const std::filesystem::path& path, const TriangleMesh& mesh);
std::string serialise_ply(const TriangleMesh& mesh);

}  // namespace organbake
