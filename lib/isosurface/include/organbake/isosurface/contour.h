// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "organbake/geometry/triangle_mesh.h"
#include "organbake/volume/volume.h"

namespace organbake {

// How near to the level a value may be, as a share of the data's range, so that the crossing is
// told from its grid point in VTK's single-precision points. Callers keep their values that far
// away from the level.
double least_distance_to_level(const std::array<int, 3>& size);

// The same triangles either way, in another order: marching cubes (Lorensen, Cline 1987) as the
// paper has it, or flying edges (Schroeder, Maynard, Geveci 2015), several times faster.
enum class IsosurfaceMethod { flying_edges, marching_cubes };

// The surface where a grid of values crosses `level`, in index coordinates, by vtkFlyingEdges3D or
// vtkMarchingCubes on the values where they lie, without a copy. Every crossing is kept 1/256 of an
// edge away from the grid points, which rids the surface of the slivers that marching cubes leaves
// there. Faces look from values ≥ level to values below.
TriangleMesh contour(std::span<const std::int16_t> values, const std::array<int, 3>& size,
                     double level, IsosurfaceMethod method = IsosurfaceMethod::flying_edges);
TriangleMesh contour(std::span<const float> values, const std::array<int, 3>& size, double level,
                     IsosurfaceMethod method = IsosurfaceMethod::flying_edges);

// Index coordinates → world. A left-handed grid turns the faces round so that they stay outward.
void move_to_world(TriangleMesh& mesh, const Volume& grid, const Eigen::Vector3d& first_index);

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
