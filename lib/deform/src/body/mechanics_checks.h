// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "organbake/bundle/base_layer.h"
#include "organbake/bundle/mechanics_model.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake::deform {

// What the solver relies on. Each throws BadDataError naming the entry and its value.
void check_mechanics(const TriangleMesh& proxy, const MechanicsModel& mechanics);
// The same of its tetrahedra, which it must have.
void check_tetrahedra(const TriangleMesh& proxy, const MechanicsModel& mechanics);
void check_base_fits(const TriangleMesh& proxy, const BaseLayer& base);

}  // namespace organbake::deform
