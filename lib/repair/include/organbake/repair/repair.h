// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

struct RepairOptions {
  // Pieces with less of the largest one's area than this share are dropped as islands; 0 = none.
  double island_share = 0.05;
  // Holes up to this width, the largest distance of two points of the rim, are closed, wider ones
  // left open; 0 = a tenth of the diagonal of the surface's box.
  double hole_mm = 0;
  // More tunnels than this (loops through a solid, its genus) are closed by a wrap. An organ has
  // hardly any, and a coarse proxy has no faces for them.
  long most_tunnels = 4;
  // What a wrap closes: tunnels and gaps narrower than this; 0 = a hundredth of the surface's size.
  double wrap_mm = 0;
  // A repair that changes the volume by more than this share is refused.
  double volume_change = 0.1;
};

struct RepairSummary {
  TriangleMesh mesh;
  std::vector<std::string> done;  // "3 duplicate faces dropped", in the order of the steps
  bool wrapped = false;
  long genus = 0;              // of what is returned
  std::size_t open_loops = 0;  // holes left open
  // Share of the volume that the surface held once its pieces looked outward and what they share
  // counted once; 0 where it never was closed.
  double volume_change = 0;
  // Largest distances of all points, mm: from the given surface without its islands and inner walls
  // to the result, and back, without what closes holes.
  double max_mm = 0, reverse_max_mm = 0;
};

// Makes a manifold, outward surface of what people's programs export: drops degenerate and
// duplicate faces, cuts edges at vertices that lie on them (T-junctions), walls inside the organ
// and fins outside (by what rays from outside see), parts solids that touch along an edge or at a
// vertex, makes the union of pieces that overlap and walls of cavities of those that lie within
// others, turns what is wound inside out, drops islands, closes small holes;
// and where that leaves no manifold, or many tunnels, wraps the surface (alpha wrapping, Portaneri
// et al. 2022) and pulls the wrap back onto it. A surface that is in order comes back as it is. The
// same for any number of threads. Changes of the volume above 1 % are warned of. Throws
// BadDataError when nothing is left, and for a volume that changes by more than is allowed.
RepairSummary repair(const TriangleMesh& surface, const RepairOptions& options,
                     const RunContext& context = {});

}  // namespace organbake
