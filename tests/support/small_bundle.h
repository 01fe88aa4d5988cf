// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "organbake/bundle/bundle.h"
#include "organbake/bundle/tetrahedral_body.h"

namespace organbake {

// A whole, valid bundle of two 8×6 cameras round a tetrahedron.
Bundle small_bundle();
// Two tetrahedra that carry a vertex at a corner and others within, for its mechanics.
TetrahedralBody small_body();
void write_bundle(const std::filesystem::path& folder, const Bundle& bundle);

}  // namespace organbake
