// SPDX-License-Identifier: Apache-2.0
#include "organbake/geometry/mesh_checks.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "organbake/core/error.h"
#include "organbake/core/union_find.h"
#include "organbake/geometry/mesh_edges.h"

namespace organbake {
namespace {

UnionFind face_components(const TriangleMesh& mesh, const MeshEdges& edges) {
  UnionFind sets(mesh.faces.size());
  edges.for_each([&](std::span<const EdgeUse> uses) {
    for (const EdgeUse& use : uses) sets.join(uses.front().face(), use.face());
  });
  return sets;
}

// A vertex is manifold when its faces hang together through edges at the vertex: one fan.
std::size_t count_non_manifold_vertices(const TriangleMesh& mesh, const MeshEdges& edges) {
  UnionFind corners(3 * mesh.faces.size());
  edges.for_each([&](std::span<const EdgeUse> uses) {
    for (const EdgeUse& use : uses) {
      corners.join(uses.front().low_corner, use.low_corner);
      corners.join(uses.front().high_corner, use.high_corner);
    }
  });
  std::vector<std::uint32_t> fans(mesh.vertices.size(), 0);
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    for (std::uint32_t c = 0; c < 3; ++c) {
      if (corners.root(3 * f + c) == 3 * f + c) ++fans[mesh.faces[f][c]];
    }
  }
  return std::count_if(fans.begin(), fans.end(), [](std::uint32_t n) { return n > 1; });
}

bool degenerate(const TriangleMesh& mesh, std::size_t f) {
  const Face& face = mesh.faces[f];
  return face[0] == face[1] || face[1] == face[2] || face[2] == face[0] || face_area(mesh, f) == 0;
}

}  // namespace

MeshTopology analyse_topology(const TriangleMesh& mesh) {
  MeshTopology t;
  t.vertices = mesh.vertices.size();
  t.faces = mesh.faces.size();
  const MeshEdges edges(mesh);
  long edge_count = 0;
  UnionFind rims(mesh.vertices.size());
  std::vector<bool> at_rim(mesh.vertices.size(), false);
  edges.for_each([&](std::span<const EdgeUse> uses) {
    ++edge_count;
    if (uses.size() == 1) {
      at_rim[uses[0].low] = at_rim[uses[0].high] = true;
      rims.join(uses[0].low, uses[0].high);
      ++t.boundary_edges;
    }
    t.non_manifold_edges += uses.size() > 2;
    t.misoriented_edges += uses.size() == 2 && uses[0].up() == uses[1].up();
  });
  for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v)
    t.boundary_loops += at_rim[v] && rims.root(v) == v;
  UnionFind components = face_components(mesh, edges);
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    t.components += components.root(f) == f;
    t.degenerate_faces += degenerate(mesh, f);
  }
  t.non_manifold_vertices = count_non_manifold_vertices(mesh, edges);
  std::vector<bool> used(mesh.vertices.size(), false);
  for (const Face& f : mesh.faces) {
    for (const std::uint32_t v : f) used[v] = true;
  }
  t.unused_vertices = std::count(used.begin(), used.end(), false);
  t.euler_characteristic =
      static_cast<long>(t.vertices - t.unused_vertices) - edge_count + static_cast<long>(t.faces);
  return t;
}

void check_mesh(const TriangleMesh& mesh, const std::string& name) {
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    if (!mesh.vertices[v].allFinite()) {
      throw BadDataError(name + ": vertex " + std::to_string(v) + " is not finite");
    }
  }
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    for (const std::uint32_t v : mesh.faces[f]) {
      if (v < mesh.vertices.size()) continue;
      throw BadDataError(name + ": face " + std::to_string(f) + " uses vertex " +
                         std::to_string(v) + " of " + std::to_string(mesh.vertices.size()));
    }
  }
  if (!mesh.colors.empty() && mesh.colors.size() != mesh.vertices.size()) {
    throw BadDataError(name + ": " + std::to_string(mesh.colors.size()) + " colours for " +
                       std::to_string(mesh.vertices.size()) + " vertices");
  }
}

namespace {

struct Components {
  UnionFind sets;                    // of faces
  std::vector<double> area_mm2;      // by root
  std::vector<std::uint32_t> roots;  // the largest first
};

Components components_of(const TriangleMesh& mesh) {
  Components all{face_components(mesh, MeshEdges(mesh)), {}, {}};
  all.area_mm2.resize(mesh.faces.size());
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    all.area_mm2[all.sets.root(f)] += face_area(mesh, f);
    if (all.sets.root(f) == f) all.roots.push_back(f);
  }
  std::stable_sort(all.roots.begin(), all.roots.end(), [&](std::uint32_t a, std::uint32_t b) {
    return all.area_mm2[a] > all.area_mm2[b];
  });
  return all;
}

}  // namespace

std::vector<double> component_areas(const TriangleMesh& mesh) {
  const Components all = components_of(mesh);
  std::vector<double> areas;
  for (const std::uint32_t root : all.roots) areas.push_back(all.area_mm2[root]);
  return areas;
}

TriangleMesh largest_components(const TriangleMesh& mesh, std::size_t count) {
  if (count == 0 || mesh.faces.empty()) return mesh;
  Components all = components_of(mesh);
  std::vector<bool> kept(mesh.faces.size(), false);
  for (std::size_t i = 0; i < std::min(count, all.roots.size()); ++i) kept[all.roots[i]] = true;

  TriangleMesh result;
  constexpr std::uint32_t kUnmapped = 0xFFFFFFFFu;
  std::vector<std::uint32_t> renumbered(mesh.vertices.size(), kUnmapped);
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    if (!kept[all.sets.root(f)]) continue;
    Face face = mesh.faces[f];
    for (std::uint32_t& v : face) {
      if (renumbered[v] == kUnmapped) {
        renumbered[v] = static_cast<std::uint32_t>(result.vertices.size());
        result.vertices.push_back(mesh.vertices[v]);
        if (!mesh.colors.empty()) result.colors.push_back(mesh.colors[v]);
      }
      v = renumbered[v];
    }
    result.faces.push_back(face);
  }
  return result;
}

}  // namespace organbake
