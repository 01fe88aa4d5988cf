// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "organbake/core/run_context.h"
#include "organbake/geometry/triangle_mesh.h"
#include "refined_proxy.h"

namespace organbake {

// Flips every edge whose flip, its four vertices refitted, takes off energy, until none does (or
// max_sweeps have gone over all edges near a change). Returns the number of flips.
std::size_t flip_edges(RefinedProxy& proxy, int max_sweeps, const RunContext& context = {});

// Takes vertices from where they matter least to where one more helps most: an edge is split and
// another collapsed, each refitted, as long as both together take off energy. Returns how often.
std::size_t relocate_vertices(RefinedProxy& proxy, int most, const RunContext& context = {});

// `after` with the vertices round any faces that meet others drawn back towards `before` (same
// faces, other places), until it meets itself no more than `before` does.
[[nodiscard]] TriangleMesh keep_apart(const TriangleMesh& before, TriangleMesh after);

}  // namespace organbake
