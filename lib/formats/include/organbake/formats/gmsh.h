// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "organbake/bundle/bundle.h"

namespace organbake {

// A bundle's tetrahedra as a mesh of gmsh (MSH 2.2, text, which gmsh 4, MuJoCo, SOFA and meshio
// read), in millimetres of the world, LPS; node i has the number i + 1. Throws UsageError for a
// bundle without tetrahedra.
std::string gmsh_text(const Bundle& bundle);

}  // namespace organbake
