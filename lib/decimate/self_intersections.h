// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "geometry/triangle_mesh.h"

namespace organbake {

// Whether a face of `some` meets another of `some` or of `others` elsewhere than where they share
// corners: an edge of one pierces the other, or two faces over one edge are folded onto each other.
bool faces_intersect(const std::vector<Eigen::Vector3d>& points, const std::vector<Face>& some,
                     const std::vector<Face>& others);

// Faces that meet another so, in ascending order. Works in the order of n log n for surfaces.
std::vector<std::uint32_t> self_intersecting_faces(const TriangleMesh& mesh);

}  // namespace organbake
