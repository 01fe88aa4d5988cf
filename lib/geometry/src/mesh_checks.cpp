// SPDX-License-Identifier: Apache-2.0
// What hangs together in a mesh: the faces and neighbours of vertices, edges, and checks of all of
// it. The edges of a soup are found by a counting sort over their lower vertex and a sort of each
// vertex's few: in proportion to the faces, where a hash map of all edges would take several times
// the memory.
#include "organbake/geometry/mesh_checks.h"

#include <algorithm>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/core/union_find.h"
#include "organbake/geometry/mesh_edges.h"

namespace organbake {
VertexFaces::VertexFaces(const std::vector<Face>& faces, std::size_t vertex_count)
    : first_(vertex_count + 1, 0), faces_(3 * faces.size()) {
  for (const Face& face : faces)
    for (const std::uint32_t vertex : face) ++first_[vertex + 1];
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  for (std::uint32_t f = 0; f < faces.size(); ++f)
    for (const std::uint32_t vertex : faces[f]) faces_[next[vertex]++] = f;
}

VertexNeighbours::VertexNeighbours(const std::vector<Face>& faces, std::size_t vertex_count)
    : first_(vertex_count + 1, 0) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;  // both ways
  edges.reserve(6 * faces.size());
  for (const Face& f : faces) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = f[k], b = f[(k + 1) % 3];
      if (a == b) continue;
      edges.emplace_back(a, b);
      edges.emplace_back(b, a);
    }
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  neighbours_.reserve(edges.size());
  for (const auto& [from, to] : edges) {
    ++first_[from + 1];
    neighbours_.push_back(to);
  }
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
}

namespace {

EdgeUse use_of(const std::vector<Face>& faces, std::uint32_t h) {
  const std::uint32_t n = next_in_face(h);
  const std::uint32_t from = faces[h / 3][h % 3], to = faces[n / 3][n % 3];
  return from < to ? EdgeUse{from, to, h, n} : EdgeUse{to, from, n, h};
}

// Faces that one meets when turning about a vertex from any half-edge that leaves it.
std::uint32_t fan_size(const std::vector<std::uint32_t>& twins, std::uint32_t h) {
  std::uint32_t count = 0, at = h;
  do {
    ++count;
    at = twins[previous_in_face(at)];
  } while (at != h && at != kNoHalfEdge);
  if (at == h) return count;
  for (at = twins[h]; at != kNoHalfEdge; at = twins[next_in_face(at)]) ++count;
  return count;
}

bool each_vertex_has_one_fan(const TriangleMesh& mesh, const std::vector<std::uint32_t>& twins) {
  std::vector<std::uint32_t> valence(mesh.vertices.size(), 0);
  for (const Face& f : mesh.faces)
    for (const std::uint32_t v : f) ++valence[v];
  for (std::uint32_t h = 0; h < twins.size(); ++h) {
    std::uint32_t& faces = valence[mesh.faces[h / 3][h % 3]];
    if (faces == 0) continue;  // looked at
    if (fan_size(twins, h) != faces) return false;
    faces = 0;
  }
  return true;
}

}  // namespace

MeshEdges::MeshEdges(const std::vector<Face>& faces, std::size_t vertex_count) {
  // Sorted by the lower vertex in one sweep; each vertex's few edges are sorted among themselves.
  std::vector<std::uint32_t> first(vertex_count + 1, 0);
  const auto half_edges = static_cast<std::uint32_t>(3 * faces.size());
  for (std::uint32_t h = 0; h < half_edges; ++h) {
    const EdgeUse use = use_of(faces, h);
    if (use.low != use.high) ++first[use.low + 1];
  }
  std::partial_sum(first.begin(), first.end(), first.begin());
  uses_.resize(first.back());
  std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
  for (std::uint32_t h = 0; h < half_edges; ++h) {
    const EdgeUse use = use_of(faces, h);
    if (use.low != use.high) uses_[next[use.low]++] = use;
  }
  constexpr std::size_t kGrain = 4096;
  parallel_pieces(std::size_t{0}, vertex_count, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      std::sort(uses_.begin() + first[v], uses_.begin() + first[v + 1],
                [](const EdgeUse& a, const EdgeUse& b) {
                  return a.high != b.high ? a.high < b.high : a.half_edge() < b.half_edge();
                });
    }
  });
}

std::vector<std::uint32_t> half_edge_twins(const TriangleMesh& mesh) {
  std::vector<std::uint32_t> twins(3 * mesh.faces.size(), kNoHalfEdge);
  MeshEdges(mesh).for_each([&](std::span<const EdgeUse> uses) {
    if (uses.size() != 2) return;
    twins[uses[0].half_edge()] = uses[1].half_edge();
    twins[uses[1].half_edge()] = uses[0].half_edge();
  });
  return twins;
}

std::optional<std::vector<std::uint32_t>> manifold_twins(const TriangleMesh& mesh) {
  const MeshEdges edges(mesh);
  bool wound_alike = edges.use_count() == 3 * mesh.faces.size();
  std::vector<std::uint32_t> twins(3 * mesh.faces.size(), kNoHalfEdge);
  edges.for_each([&](std::span<const EdgeUse> uses) {
    if (uses.size() == 1) return;
    wound_alike &= uses.size() == 2 && uses[0].up() != uses[1].up();
    twins[uses[0].half_edge()] = uses[1].half_edge();
    twins[uses[1].half_edge()] = uses[0].half_edge();
  });
  if (!wound_alike || !each_vertex_has_one_fan(mesh, twins)) return std::nullopt;
  return twins;
}

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
    for (std::uint32_t c = 0; c < 3; ++c)
      if (corners.root(3 * f + c) == 3 * f + c) ++fans[mesh.faces[f][c]];
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
  for (const Face& f : mesh.faces)
    for (const std::uint32_t v : f) used[v] = true;
  t.unused_vertices = std::count(used.begin(), used.end(), false);
  t.euler_characteristic =
      static_cast<long>(t.vertices - t.unused_vertices) - edge_count + static_cast<long>(t.faces);
  return t;
}

void check_mesh(const TriangleMesh& mesh, const std::string& name) {
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    if (!mesh.vertices[v].allFinite())
      throw BadDataError(name + ": vertex " + std::to_string(v) + " is not finite");
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    for (const std::uint32_t v : mesh.faces[f]) {
      if (v < mesh.vertices.size()) continue;
      throw BadDataError(name + ": face " + std::to_string(f) + " uses vertex " +
                         std::to_string(v) + " of " + std::to_string(mesh.vertices.size()));
    }
  }
  if (!mesh.colors.empty() && mesh.colors.size() != mesh.vertices.size())
    throw BadDataError(name + ": " + std::to_string(mesh.colors.size()) + " colours for " +
                       std::to_string(mesh.vertices.size()) + " vertices");
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

  TriangleMesh result{mesh.vertices, {}, mesh.colors};
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f)
    if (kept[all.sets.root(f)]) result.faces.push_back(mesh.faces[f]);
  drop_unused_vertices(result);
  return result;
}

void drop_unused_vertices(TriangleMesh& mesh) {
  constexpr std::uint32_t kUnmapped = 0xFFFFFFFFu;
  std::vector<std::uint32_t> renumbered(mesh.vertices.size(), kUnmapped);
  TriangleMesh used;
  for (Face& face : mesh.faces) {
    for (std::uint32_t& v : face) {
      if (renumbered[v] == kUnmapped) {
        renumbered[v] = static_cast<std::uint32_t>(used.vertices.size());
        used.vertices.push_back(mesh.vertices[v]);
        if (!mesh.colors.empty()) used.colors.push_back(mesh.colors[v]);
      }
      v = renumbered[v];
    }
  }
  mesh.vertices = std::move(used.vertices);
  mesh.colors = std::move(used.colors);
}

}  // namespace organbake
