// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/decimate/mesh_defects.h"

#include <algorithm>
#include <string>

#include "organbake/core/error.h"
#include "organbake/core/union_find.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/mesh_edges.h"

namespace organbake {
namespace {

constexpr std::uint32_t kNoVertexYet = 0xFFFFFFFFu;

bool repeats_a_corner(const Face& f) { return f[0] == f[1] || f[1] == f[2] || f[2] == f[0]; }

void refuse_non_manifold_edges(const MeshTopology& topology) {
  if (topology.faces == 0) throw BadDataError("surface to decimate: it has no faces");
  if (topology.non_manifold_edges > 0) {
    throw BadDataError("surface to decimate: " + std::to_string(topology.non_manifold_edges) +
                       " edges belong to three or more faces; repair it to a manifold first, or "
                       "use the method 'cluster'");
  }
  if (topology.misoriented_edges > 0) {
    throw BadDataError("surface to decimate: neighbouring faces are wound against each other at " +
                       std::to_string(topology.misoriented_edges) +
                       " edges; orient its faces consistently first");
  }
}

// Corners (3·face + corner) that share a vertex and hang together through edges at it.
class CornerFans {
 public:
  explicit CornerFans(const TriangleMesh& mesh) : corners_(3 * mesh.faces.size()) {
    MeshEdges(mesh).for_each([&](std::span<const EdgeUse> uses) {
      for (const EdgeUse& use : uses) {
        corners_.join(uses.front().low_corner, use.low_corner);
        corners_.join(uses.front().high_corner, use.high_corner);
      }
    });
  }

  std::uint32_t find(std::uint32_t corner) { return corners_.root(corner); }

 private:
  UnionFind corners_;
};

// An open surface has no inside: its winding says which side is seen, whatever its "volume" is.
TriangleMesh outward(TriangleMesh mesh) {
  if (signed_volume(mesh) < 0 && analyse_topology(mesh).boundary_edges == 0) {
    for (Face& face : mesh.faces) std::swap(face[1], face[2]);
  }
  return mesh;
}

bool uses_all_vertices(const TriangleMesh& mesh) {
  std::vector<bool> used(mesh.vertices.size(), false);
  for (const Face& f : mesh.faces) {
    for (const std::uint32_t v : f) used[v] = true;
  }
  return std::find(used.begin(), used.end(), false) == used.end();
}

}  // namespace

TriangleMesh manifold_faces(const TriangleMesh& surface) {
  check_mesh(surface, "surface to decimate");
  if (!surface.empty() && uses_all_vertices(surface) && manifold_twins(surface)) {
    return outward({.vertices = surface.vertices, .faces = surface.faces, .colors = {}});
  }
  TriangleMesh kept{.vertices = surface.vertices, .faces = {}, .colors = {}};
  std::remove_copy_if(surface.faces.begin(), surface.faces.end(), std::back_inserter(kept.faces),
                      repeats_a_corner);
  refuse_non_manifold_edges(analyse_topology(kept));

  TriangleMesh result;
  result.faces.reserve(kept.faces.size());
  CornerFans fans(kept);
  std::vector<std::uint32_t> vertex_of_fan(3 * kept.faces.size(), kNoVertexYet);
  for (std::uint32_t f = 0; f < kept.faces.size(); ++f) {
    Face face;
    for (std::uint32_t c = 0; c < 3; ++c) {
      std::uint32_t& vertex = vertex_of_fan[fans.find(3 * f + c)];
      if (vertex == kNoVertexYet) {
        vertex = static_cast<std::uint32_t>(result.vertices.size());
        result.vertices.push_back(surface.vertices[kept.faces[f][c]]);
      }
      face[c] = vertex;
    }
    result.faces.push_back(face);
  }
  return outward(std::move(result));
}

}  // namespace organbake
