// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// A body's parts that are thick each in its own way: an organ, and the vessels that leave it.
struct ThicknessRegions {
  std::vector<double> thickness_mm;    // of each; none where the surface has a border
  std::vector<std::uint32_t> of_face;  // the region of each face of the surface
};

// Thickness is 2 · volume / area: a plate's own, a long tube's radius, two thirds of a ball's. Its
// local form is half the mean chord through the body from a point of the surface, directions
// weighted by their cosine; over the whole surface that is 2 · volume / area again (Cauchy's
// formula, Santaló 1976). Each connected surface is a region; where a connected part of a region
// is less than half as thick as the region, and longer than wide, it is one of its own. The same
// for any number of threads.
ThicknessRegions thickness_regions(const TriangleMesh& surface, const RunContext& context = {});

}  // namespace organbake
