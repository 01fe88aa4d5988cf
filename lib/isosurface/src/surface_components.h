// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <string>

#include "organbake/geometry/triangle_mesh.h"
#include "organbake/isosurface/isosurface.h"

namespace organbake {

// What becomes of the walls of cavities, the pieces of negative volume, which are no pieces of
// their own: the lungs' walls in a body can have more area than its skin. They go (unless all is
// kept), or each stays with the piece that it lies in, unless it is a mere gap. Open surfaces have
// none.
enum class Cavities { filled, kept, none };

struct ComponentFilter {
  std::size_t largest = 1;  // pieces of largest area that are kept; 0 = all
  double min_size_mm = 0;   // pieces, and cavities, whose box is nowhere longer go; 0 = none
  Cavities cavities = Cavities::filled;
};

struct KeptComponents {
  TriangleMesh mesh;
  std::size_t found = 0;
  std::size_t kept = 0;
  double left_out_share = 0;  // of the pieces' volume; of the area of open ones
};

// Keeps the connected pieces that pass the filter, in their order; the mesh is empty when none
// does.
KeptComponents keep_components(TriangleMesh mesh, const ComponentFilter& filter);

// Index coordinates → world. A left-handed grid turns the faces round so that they stay outward.
void move_to_world(TriangleMesh& mesh, const Volume& grid, const Eigen::Vector3d& first_index);

// What CT and mask surfaces share once they lie in the world: the pieces' filter and the smoothing.
// What is said begins with `whose`, "liver: ". Throws BadDataError when no piece is left.
Isosurface finished(TriangleMesh mesh, const IsosurfaceOptions& options, Cavities cavities,
                    const std::string& whose, const RunContext& context);

}  // namespace organbake
