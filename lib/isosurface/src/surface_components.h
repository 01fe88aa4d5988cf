// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "organbake/geometry/triangle_mesh.h"
#include "organbake/isosurface/isosurface.h"

namespace organbake {

struct ComponentFilter {
  std::size_t largest = 1;  // pieces of largest area that are kept; 0 = all
  double min_size_mm = 0;   // pieces whose box is nowhere longer go; 0 = none
  // Pieces of negative volume are the walls of cavities and are passed over while there are others:
  // the lungs' walls in a body can have more area than its skin, and alone they are a solid inside
  // out. Not when all pieces are kept.
  bool outward_only = true;
};

struct KeptComponents {
  TriangleMesh mesh;
  std::size_t found = 0;
  std::size_t kept = 0;
  // Of the pieces' volume, cavities' walls not counted; of their area where none has a volume.
  double left_out_share = 0;
};

// Keeps the connected pieces that pass the filter, in their order; the mesh is empty when none
// does.
KeptComponents keep_components(TriangleMesh mesh, const ComponentFilter& filter);

// What CT and mask surfaces share once they lie in the world: the pieces' filter and the smoothing.
// Throws BadDataError when no piece is left.
Isosurface finished(TriangleMesh mesh, const IsosurfaceOptions& options, const RunContext& context);

}  // namespace organbake
