// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "body/tissue.h"
#include "organbake/deform/deformer.h"

namespace organbake::deform {

// What stands for the tissue of some bodies: springs, or finite elements. Throws UsageError for
// tetrahedra that are asked for and not there, BadDataError for mechanics that cannot be used.
std::unique_ptr<const Tissue> make_tissue(const DeformBodies& bodies, const DeformOptions& options);

// How stiffly each body's volume is kept beside that. Springs don't know of volume; elements resist
// its change by Poisson's ratio.
std::vector<double> kept_volumes(const DeformBodies& bodies, const DeformOptions& options);

// The bodies, if their skins fit them; else throws BadDataError.
const DeformBodies& checked_skins(const DeformBodies& bodies);

}  // namespace organbake::deform
