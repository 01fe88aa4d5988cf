// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/core/run_context.h"
#include "organbake/geometry/triangle_mesh.h"
#include "refined_proxy.h"

namespace organbake {

// Flips edges and takes vertices from where they matter least to where one more helps most, each
// with the vertices round it refitted, as long as that takes off energy. Whether any did.
bool improve_by_moves(RefinedProxy& proxy, const RunContext& context = {});

// `after` with the vertices round any faces that meet others drawn back towards `before` (same
// faces, other places), until it meets itself no more than `before` does.
[[nodiscard]] TriangleMesh keep_apart(const TriangleMesh& before, TriangleMesh after);

}  // namespace organbake
