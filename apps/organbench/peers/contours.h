// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/geometry/triangle_mesh.h"
#include "organbake/volume/volume.h"

namespace organbake {

// VTK's filters as one calls them, on the voxels where they lie: no largest component, no cap, no
// check, no copy into a mesh of ours unless asked for. Flying edges use as many threads as TBB may.
std::size_t vtk_flying_edges_faces(const Volume& ct, double level);
std::size_t vtk_marching_cubes_faces(const Volume& ct, double level);
TriangleMesh vtk_marching_cubes(const Volume& ct, double level);  // world mm

}  // namespace organbake
