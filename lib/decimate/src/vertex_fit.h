// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit_reference.h"
#include "fit_term.h"
#include "organbake/core/run_context.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

struct FitOptions {
  int steps = 10;           // evaluations of all distances
  double power = 2;         // of the distance; see FitNorm
  bool keep_volume = true;  // of a closed surface
};

// Moves a proxy's vertices so that the two-sided sampled distance to the reference gets small
// (Gauss–Newton, closest points renewed at each step). No face turns over within a step, and
// slivers are kept from folding onto their neighbours; the result is the best of the iterates, at
// worst the proxy given. The same for any number of threads.
TriangleMesh fit_vertices(TriangleMesh proxy, const FitReference& reference,
                          const FitOptions& options, const RunContext& context = {});

// Largest distance from a sample to the other surface, either way.
double largest_distance(const TriangleMesh& proxy, const FitReference& reference);

// How much the volume grows when a vertex moves, one per vertex (mm²).
std::vector<Eigen::Vector3d> volume_gradient(const TriangleMesh& mesh);

}  // namespace organbake
