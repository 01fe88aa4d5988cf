// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// What a mesh is, counted from its faces alone.
struct MeshTopology {
  std::size_t vertices = 0;
  std::size_t faces = 0;
  std::size_t components = 0;          // by shared edges
  std::size_t boundary_edges = 0;      // used by one face
  std::size_t boundary_loops = 0;      // rims of them; rims that touch at a vertex are one
  std::size_t non_manifold_edges = 0;  // used by three or more faces
  std::size_t misoriented_edges = 0;   // used twice in the same direction
  std::size_t non_manifold_vertices = 0;
  std::size_t degenerate_faces = 0;  // a repeated corner or zero area
  std::size_t unused_vertices = 0;
  long euler_characteristic = 0;

  bool closed_manifold() const {
    return faces > 0 && boundary_edges == 0 && non_manifold_edges == 0 && misoriented_edges == 0 &&
           non_manifold_vertices == 0;
  }
};

MeshTopology analyse_topology(const TriangleMesh& mesh);

// Throws BadDataError when an index is out of range, a coordinate is not finite, or colors has the
// wrong length; `name` is put before the message.
void check_mesh(const TriangleMesh& mesh, const std::string& name);

// Keeps the `count` components of largest surface area (all when 0), dropping unused vertices.
[[nodiscard]] TriangleMesh largest_components(const TriangleMesh& mesh, std::size_t count);
// The areas of all of them, mm², in that order.
std::vector<double> component_areas(const TriangleMesh& mesh);

// Leaves the vertices that faces have, in the order in which these name them first.
void drop_unused_vertices(TriangleMesh& mesh);

}  // namespace organbake
