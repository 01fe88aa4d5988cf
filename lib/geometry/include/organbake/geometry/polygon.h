// SPDX-License-Identifier: Apache-2.0
#pragma once

// Meshes as files hold them: polygons, strips, vertices that stand there once for each face, and
// colours of any scale.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// Appends the triangles of a simple, about planar polygon of corners that index `vertices` (indices
// beyond them: the polygon is fanned, for a later check to refuse). A convex polygon becomes a fan
// about its first corner, a concave one is cut by ears; fewer than three corners give nothing.
void cut_polygon(const std::vector<Eigen::Vector3d>& vertices,
                 std::span<const std::uint32_t> polygon, std::vector<Face>& faces);

// Appends the triangles of a strip: every second one is turned, so that all are wound alike; those
// with a repeated corner, which only join strips, are left out.
void cut_strip(std::span<const std::uint32_t> strip, std::vector<Face>& faces);

struct WeldSummary {
  std::size_t exact = 0;    // vertices merged into others at the very same place
  std::size_t near = 0;     // into others within the tolerance
  double tolerance_mm = 0;  // that was used for those; 0 = none
};

// Merges the vertices of open edges that coincide: exactly; then, if edges are still open, within
// 1e-6 of the mesh's size where that closes edges and makes none non-manifold. Vertices inside the
// surface are left alone, so that bodies which touch stay apart. A merged vertex has the mean
// colour. Faces that shrink to an edge are dropped. The mesh must be checked (check_mesh).
WeldSummary weld(TriangleMesh& mesh);

// How a file's colours are written. `number`: 0…1 if none exceeds 1, else 0…255, else 0…65535.
enum class ColorScale { linear, number, byte, two_bytes };

// Scene-linear colours of those that a file holds; all but linear ones are sRGB (IEC 61966-2-1).
std::vector<Eigen::Vector3f> linear_colors(const std::vector<Eigen::Vector3d>& written,
                                           ColorScale scale);

// The colour of each of `vertex_count` vertices: the mean of its faces'; black without a face.
std::vector<Eigen::Vector3f> vertex_from_face_colors(
    const std::vector<Face>& faces, const std::vector<Eigen::Vector3f>& face_colors,
    std::size_t vertex_count);

}  // namespace organbake
