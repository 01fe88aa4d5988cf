// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "organbake/bundle/mechanics_model.h"
#include "organbake/cutting/cut_body.h"
#include "organbake/cutting/cut_sheet.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake::test {

// Cubes from the origin on, five tetrahedra each.
TetrahedralBody block(const Eigen::Array3i& count, double cell_mm);
// Tetrahedra that fill a closed skin and stand out of it, its vertices embedded. The nodes whose y
// is the least are anchors.
TetrahedralBody tissue_under(const TriangleMesh& skin, double cell_mm);

// A stroke along a polyline of the blade's tip, its edge `up` long.
void add_stroke(const std::vector<Eigen::Vector3d>& tips, const Eigen::Vector3d& up,
                CutSheet& sheet);

EdgeCrossings crossings(const TetrahedralBody& body, const MaterialGrid& grid);
double volume_mm3(const TetrahedralBody& body);
// mm³ by fragment, of whole tetrahedra (their fill is not asked for).
std::vector<double> fragment_volumes(const CutTetrahedra& cut, const TetrahedralBody& body);
// Whether every edge is used as often one way as the other.
bool is_closed(const TriangleMesh& mesh);

}  // namespace organbake::test
