// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "body/tissue.h"
#include "organbake/bundle/base_layer.h"
#include "organbake/bundle/mechanics_model.h"
#include "organbake/deform/deformer.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake::deform {

// What the solver relies on. Each throws BadDataError naming the entry and its value.
void check_mechanics(const TriangleMesh& proxy, const MechanicsModel& mechanics);
// The same of its tetrahedra, which it must have.
void check_tetrahedra(const TriangleMesh& proxy, const MechanicsModel& mechanics);
void check_base_fits(const TriangleMesh& proxy, const BaseLayer& base);

// What stands for the tissue of some bodies: springs, or finite elements. Throws UsageError for
// tetrahedra that are asked for and not there, BadDataError for mechanics that cannot be used.
std::unique_ptr<const Tissue> make_tissue(const DeformBodies& bodies, const DeformOptions& options);

// How stiffly each body's volume is kept beside that. Springs don't know of volume; elements resist
// its change by Poisson's ratio.
std::vector<double> kept_volumes(const DeformBodies& bodies, const DeformOptions& options);

// The bodies, if their skins fit them; else throws BadDataError.
const DeformBodies& checked_skins(const DeformBodies& bodies);

}  // namespace organbake::deform
