// SPDX-License-Identifier: Apache-2.0
// Edges of triangle soups by counting sort over their lower vertex and a sort of each vertex's few:
// in proportion to the faces, where a hash map of all edges would take several times the memory.
#include "organbake/geometry/mesh_edges.h"

#include <numeric>
#include <utility>

#include "organbake/core/parallel.h"

namespace organbake {
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
  for (const Face& f : mesh.faces) {
    for (const std::uint32_t v : f) ++valence[v];
  }
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

}  // namespace organbake
