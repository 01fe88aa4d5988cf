// SPDX-License-Identifier: Apache-2.0
#pragma once

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

}  // namespace organbake
