// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "organbake/geometry/smooth_skin.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// Closed outward meshes with known answers (mm).
TriangleMesh tetrahedron_mesh();                               // corners 0, x, y, z: volume 1/6
TriangleMesh box_mesh(const Eigen::Vector3d& size_mm);         // from 0 to size
TriangleMesh sphere_mesh(double radius_mm, int subdivisions);  // 20·4ⁿ faces, vertices on it
// A star-shaped body that no mirroring maps onto itself.
TriangleMesh lumpy_mesh(double radius_mm, int subdivisions);
// A closed box round the origin, every side a regular grid of 2·cells² triangles: rays can be
// aimed at its vertices, and cells can be merged again without error.
TriangleMesh grid_box(const Eigen::Vector3d& size_mm, int cells);

// A cone with so many faces about its tip, and as many about the middle of its base.
TriangleMesh cone_mesh(std::uint32_t sides);

// A closed body of revolution about z: its outline as (radius, z) from the lowest point to the
// highest, both on the axis.
TriangleMesh revolved_mesh(const std::vector<Eigen::Vector2d>& outline_mm, std::uint32_t sides);
// A ring about z: a tube of that radius round a circle. 2 · volume / area is the tube's radius.
TriangleMesh torus_mesh(double circle_mm, double tube_mm, std::uint32_t around,
                        std::uint32_t across);
// A ball about 0 with a stalk along +z, whose end is rounded: an organ and a vessel that leaves it.
TriangleMesh ball_with_stalk(double ball_mm, double stalk_mm, double length_mm);

// The same mesh elsewhere, larger, mirrored in x (and still outward), or with its inside outward.
TriangleMesh moved(TriangleMesh mesh, const Eigen::Vector3d& by_mm);
TriangleMesh scaled(TriangleMesh mesh, double factor);
TriangleMesh mirrored(TriangleMesh mesh);
TriangleMesh inside_out(TriangleMesh mesh);
// Both meshes in one, nothing merged.
TriangleMesh joined(TriangleMesh a, const TriangleMesh& b);
// The faces on the normal's side of a plane `offset_mm` from the middle of the mesh's box.
TriangleMesh cut_in_half(const TriangleMesh& mesh, const Eigen::Vector3d& normal,
                         double offset_mm = 0);
// Every face with corners of its own, as STL has them.
TriangleMesh soup_of(const TriangleMesh& mesh);

// A smooth skin that is not smooth: every node lies on its face of the proxy, by the corners'
// barycentric weights.
SmoothSkin flat_skin(const TriangleMesh& proxy, std::uint32_t steps);

// The same with each corner's weight spread over its neighbours by this share: carried, like baked
// skins, by more vertices than those of its face.
SmoothSkin spread_skin(const TriangleMesh& proxy, std::uint32_t steps, double share);

}  // namespace organbake
