// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/core/union_find.h"
#include "organbake/geometry/mesh_edges.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/raycast/ray_scene.h"

namespace organbake {

// Whether a face of `some` meets another of `some` or of `others` elsewhere than where they share
// corners: an edge of one pierces the other, or two faces over one edge are folded onto each other.
bool faces_intersect(const std::vector<Eigen::Vector3d>& points, const std::vector<Face>& some,
                     const std::vector<Face>& others);

// Faces that meet another so, in ascending order, in the order of n log n for surfaces. The search
// is given up where so many faces have common boxes that it would take their number's square: a
// heap of them, or a fan of tens of thousands.
struct SelfIntersections {
  std::vector<std::uint32_t> faces;
  bool complete = true;
};
[[nodiscard]] SelfIntersections self_intersections(const TriangleMesh& mesh);
std::vector<std::uint32_t> self_intersecting_faces(const TriangleMesh& mesh);  // those found

// Which bodies overlap: pairs of them (a < b, in order) of which faces meet so, or lie upon one
// another looking the same way, as a body's faces do that is there twice. `body` holds one for
// every face; bodies share no vertices, and are wound outward. Given up as the search above.
using BodyPair = std::pair<std::uint32_t, std::uint32_t>;
std::vector<BodyPair> overlapping_bodies(const TriangleMesh& mesh,
                                         const std::vector<std::uint32_t>& body);

// The surface as a half-edge structure can hold it: faces with a repeated corner dropped (their
// neighbours then meet), vertices where several fans touch split into one copy a fan, unused
// vertices dropped, colours dropped. Faces of a closed surface are turned outward as a whole when
// the volume is negative; single components are left as they are, for an inward one may be a
// cavity. Throws BadDataError with the count when edges have three or more faces, or neighbouring
// faces are wound against each other: such a surface has no unique repair.
TriangleMesh manifold_faces(const TriangleMesh& surface);

// Corners (3·face + corner) of one fan hang together through edges at their vertex: what two uses
// of an edge tell of that; and the mesh with a vertex for each fan, colours going along, and no
// other.
inline void join_fans(const EdgeUse& a, const EdgeUse& b, UnionFind& fans) {
  fans.join(a.low_corner, b.low_corner);
  fans.join(a.high_corner, b.high_corner);
}
TriangleMesh split_fans(const TriangleMesh& mesh, UnionFind& fans);

// A surface as CGAL holds it (CGAL::Surface_mesh); place(vertex) tells where a vertex lies.
template <class SurfaceMesh, class Place>
TriangleMesh triangles_of(const SurfaceMesh& mesh, const Place& place) {
  TriangleMesh result;
  std::vector<std::uint32_t> number(mesh.num_vertices());  // removed ones count
  for (const auto vertex : mesh.vertices()) {
    number[vertex] = static_cast<std::uint32_t>(result.vertices.size());
    result.vertices.push_back(place(mesh.point(vertex)));
  }
  for (const auto face : mesh.faces()) {
    Face corners{};
    auto corner = corners.begin();
    for (const auto vertex : mesh.vertices_around_face(mesh.halfedge(face)))
      *corner++ = number[vertex];
    result.faces.push_back(corners);
  }
  return result;
}

struct MeshDistance {
  double mean_mm = 0;
  double rms_mm = 0;
  double max_mm = 0;  // over the samples: a lower bound of the one-sided Hausdorff distance
};

// One-sided distance: from `samples` points spread evenly by area over `from` (stratified, one
// random stream a sample) to their closest points on `to`. The same for any number of threads.
// Throws BadDataError when `from` is unusable or has no area.
MeshDistance mesh_distance(const TriangleMesh& from, const RayScene& to, std::size_t samples,
                           std::uint64_t seed, const RunContext& context = {});

// The one-sided Hausdorff distance in mm from all points of `from`, not samples, to `to` (whose
// search tree is `scene`), by branch and bound over the faces of `from`: never below it and at most
// 0.05 % above, as far as pieces of 1/1024 of a face's edge tell, or of 1/4 to 1/32
// where a face covers several in its plane. The same for any number of threads. Throws BadDataError
// when `from` is unusable.
double largest_distance(const TriangleMesh& from, const TriangleMesh& to, const RayScene& scene,
                        const RunContext& context = {});

// Faces in groups: the group of each, and how many groups there are.
struct FaceGroups {
  const std::vector<std::uint32_t>& of_face;
  std::size_t count;
};
// The same from the points of each group's faces; 0 for a group without any.
std::vector<double> largest_distances(const TriangleMesh& from, const FaceGroups& groups,
                                      const TriangleMesh& to, const RayScene& scene,
                                      const RunContext& context = {});

}  // namespace organbake
