// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/geometry/triangle_mesh.h"
#include "organbake/volume/volume.h"

namespace organbake {

// Puts the vertices of a contour, each on an edge of the volume's grid and in its index
// coordinates, where the straight line between the edge's two values crosses `level`, in double
// precision. The contour may have been made at any level that parts the voxels alike. A crossing
// keeps its 1/256 of an edge from the grid points; a vertex beyond the volume's border, or beside a
// NaN, stays.
void place_crossings(TriangleMesh& mesh, const Volume& ct, double level);

// The same by more than two voxels. A CT's voxel holds the mean over its own length; where an edge
// of tissue cuts one voxel of a thick slice, the straight line between two values is up to 0.09
// slices off. The sum of the voxels across the edge has no such error (the height functions of
// volume-of-fluid methods, Cummins, Francois, Kothe 2005): the values are followed outward to where
// they stop rising and falling, and the edge lies where that many voxels of the one plateau and of
// the other give the same sum; a level that is not half-way lies a share of a voxel from there.
// Where the plateaus are not reached (edges seen under a grazing angle, thin walls) the straight
// line counts. Vertices never leave their edges.
void refine_crossings(TriangleMesh& mesh, const Volume& ct, double level);

}  // namespace organbake
