// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// A mesh as other programs write it, in the formats that the project reads and does not write.
std::string as_obj(const TriangleMesh& mesh);
std::string as_off(const TriangleMesh& mesh);
std::string as_vtk(const TriangleMesh& mesh, const std::string& more = {});
// As VTK 9 does: version 5.1, big-endian, offsets and corners apart, a field and metadata.
std::string as_binary_vtk(const TriangleMesh& mesh);
std::string as_binary_stl(const TriangleMesh& mesh);
std::string as_ascii_stl(const TriangleMesh& mesh);
std::string as_vtp(const TriangleMesh& mesh);
// An unstructured grid of cells of one kind: 5 triangles, 9 quads, 10 tetrahedra, 12 hexahedra.
std::string as_vtu(const std::vector<Eigen::Vector3d>& points,
                   const std::vector<std::vector<std::uint32_t>>& cells, int kind);
std::vector<std::vector<std::uint32_t>> triangles_of(const TriangleMesh& mesh);
// Binary glTF in metres; `node` is more of the only node's JSON.
std::string as_glb(const TriangleMesh& mesh, const std::string& node = {});

}  // namespace organbake
