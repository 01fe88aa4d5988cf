// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "organbake/bundle/mechanics_model.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// What TetrahedralBody::give_mm_per_n holds, by the model's tetrahedra and patches and the radius
// of its instrument: nothing of vertices that are held.
std::vector<double> skin_gives(const TriangleMesh& proxy, const MechanicsModel& model);

}  // namespace organbake
