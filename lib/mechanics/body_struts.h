// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "geometry/triangle_mesh.h"
#include "mechanics/spring_network.h"

namespace organbake {

// Struts that keep the body's shape: from every vertex a column of its share of the surface
// (vertex_area_mm2) goes straight in and ends on the corners of the face opposite, by their
// barycentric weights. Where nothing lies opposite (an open or broken proxy), it ends at the
// vertex that lies best in that direction, if any does.
void add_body_struts(const TriangleMesh& proxy, const std::vector<double>& vertex_area_mm2,
                     SpringNetwork& network);

}  // namespace organbake
