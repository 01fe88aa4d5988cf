// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "geometry/triangle_mesh.h"

namespace organbake {

struct KeptComponents {
  TriangleMesh mesh;
  std::size_t found = 0;
  std::size_t kept = 0;
};

// Keeps the `count` connected pieces of largest area, all when 0. With `outward_only`, pieces of
// negative volume are the walls of cavities and are passed over while there are others: the lungs'
// walls in a body can have more area than its skin, and alone they are a solid inside out.
KeptComponents keep_largest(TriangleMesh mesh, std::size_t count, bool outward_only);

}  // namespace organbake
