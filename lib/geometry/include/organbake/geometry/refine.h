// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// A place on a mesh: weights u, v of the face's corners 1 and 2, the rest of corner 0.
struct SurfacePlace {
  std::uint32_t face = 0;
  float u = 0, v = 0;
};

struct RefinedMesh {
  TriangleMesh mesh;                 // the coarse vertices first, as they were; no colours
  std::vector<SurfacePlace> places;  // of each vertex, on the coarse mesh
};

// Halves edges longer than longest_mm until none is left: the same surface, so that what is kept
// per vertex (colour) gets as fine as wanted. Neighbours stay joined. Vertices without a face keep
// place 0. Throws UsageError unless longest_mm is positive, or when the result would pass
// most_faces.
RefinedMesh refine_edges(const TriangleMesh& coarse, double longest_mm,
                         std::size_t most_faces = 50'000'000);

}  // namespace organbake
