// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// PLY, ASCII or binary of either byte order, with polygons or triangle strips. Coordinates of any
// type. Colours red/green/blue, diffuse_ or plain r/g/b, of vertices or else of faces, are sRGB as
// bytes, two bytes, or numbers to 1 or 255; floats that write_ply wrote are linear (its comment
// tells). Throws NoInputError or BadDataError; counts are checked against the file's size before
// memory is taken.
TriangleMesh read_ply(const std::filesystem::path& path);
TriangleMesh parse_ply(std::span<const std::byte> bytes, const std::string& name);

// Binary little-endian: double x y z, float red green blue (linear) when the mesh has colours.
void write_ply(const std::filesystem::path& path, const TriangleMesh& mesh);
std::string serialise_ply(const TriangleMesh& mesh);

}  // namespace organbake
