// SPDX-License-Identifier: GPL-3.0-or-later
// Vertices of hundreds of faces made into trees of small fans by flipping every second spoke, again
// and again: what a queue of edge collapses would look round for each of its steps.
#include "split_hubs.h"

#include <Eigen/Geometry>
#include <string>
#include <unordered_map>
#include <unordered_set>

#include "organbake/core/error.h"
#include "organbake/geometry/adjacency.h"
#include "organbake/geometry/mesh_edges.h"

namespace organbake {
namespace {

// More spokes than any surface of about even triangles has at a vertex. Edge collapses look at all
// of them for each, again and again: a thousand take ten seconds, two thousand a minute.
constexpr std::size_t kManySpokes = 128, kMostSpokes = 2000;

// The vertices round a vertex, in the order in which its faces are wound.
struct Rim {
  std::vector<std::uint32_t> vertices;
  bool closed = true;
};

class HubSplitter {
 public:
  explicit HubSplitter(TriangleMesh& mesh) : mesh_(mesh) {
    for (const Face& f : mesh.faces)
      for (int c = 0; c < 3; ++c) edges_.insert(edge_key(f[c], f[(c + 1) % 3]));
  }

  // faces: of the hub, before any fan was split. Leaves a hub that shares one with another fan.
  void split(std::uint32_t hub, std::span<const std::uint32_t> faces, std::vector<bool>& is_new) {
    for (const std::uint32_t f : faces)
      if (is_new[f]) return;
    Rim rim = rim_of(hub, faces);
    std::vector<Face> fan;
    for (std::size_t before = 0;
         rim.vertices.size() > kManySpokes && rim.vertices.size() != before;) {
      before = rim.vertices.size();
      rim.vertices = cut_every_second(hub, rim, fan);
    }
    const std::size_t n = rim.vertices.size(), left = rim.closed ? n : n - 1;
    for (std::size_t k = 0; k < left; ++k)
      fan.push_back({hub, rim.vertices[k], rim.vertices[(k + 1) % n]});
    for (std::size_t k = 0; k < faces.size(); ++k) {
      mesh_.faces[faces[k]] = fan[k];
      is_new[faces[k]] = true;
    }
  }

 private:
  Rim rim_of(std::uint32_t hub, std::span<const std::uint32_t> faces) const {
    std::unordered_map<std::uint32_t, std::uint32_t> next;
    std::unordered_set<std::uint32_t> reached;
    std::uint32_t start = kNoHalfEdge;
    for (const std::uint32_t f : faces) {
      std::uint32_t h = 3 * f;
      while (corner(h) != hub) h = next_in_face(h);
      const std::uint32_t a = corner(next_in_face(h)), b = corner(previous_in_face(h));
      if (start == kNoHalfEdge) start = a;
      next[a] = b;
      reached.insert(b);
    }
    Rim rim;
    for (const std::uint32_t f : faces)
      for (const std::uint32_t v : mesh_.faces[f])
        if (v != hub && !reached.contains(v)) start = v, rim.closed = false;
    for (std::uint32_t v = start; rim.vertices.size() <= faces.size(); v = next.at(v)) {
      rim.vertices.push_back(v);
      if (!next.contains(v) || next.at(v) == start) break;
    }
    return rim;
  }

  // Flips every second spoke into an edge between its neighbours; returns the rim that is left.
  std::vector<std::uint32_t> cut_every_second(std::uint32_t hub, const Rim& rim,
                                              std::vector<Face>& ears) {
    const std::vector<std::uint32_t>& all = rim.vertices;
    std::vector<std::uint32_t> left;
    for (std::size_t k = 0; k < all.size(); ++k) {
      const std::uint32_t b = all[(k + 1) % all.size()];
      const bool inside = k % 2 == 1 && (rim.closed || k + 1 < all.size());
      if (!inside || !may_flip(hub, all[k - 1], all[k], b)) {
        left.push_back(all[k]);
        continue;
      }
      ears.push_back({all[k - 1], all[k], b});
      edges_.erase(edge_key(hub, all[k]));
      edges_.insert(edge_key(all[k - 1], b));
    }
    return left;
  }

  // Whether the faces stay about where they were, and the surface manifold.
  bool may_flip(std::uint32_t hub, std::uint32_t a, std::uint32_t m, std::uint32_t b) const {
    constexpr double kCosine = 0.5;
    if (edges_.contains(edge_key(a, b))) return false;
    const Eigen::Vector3d was = (normal(hub, a, m) + normal(hub, m, b)).normalized();
    return normal(hub, a, b).normalized().dot(was) > kCosine &&
           normal(a, m, b).normalized().dot(was) > kCosine;
  }
  Eigen::Vector3d normal(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
    const auto& v = mesh_.vertices;
    return (v[b] - v[a]).cross(v[c] - v[a]);
  }
  std::uint32_t corner(std::uint32_t half_edge) const {
    return mesh_.faces[half_edge / 3][half_edge % 3];
  }

  TriangleMesh& mesh_;
  std::unordered_set<std::uint64_t> edges_;
};

std::vector<std::uint32_t> hubs_of(const TriangleMesh& mesh, const VertexFaces& around) {
  std::vector<std::uint32_t> hubs;
  for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v)
    if (around.of(v).size() > kManySpokes) hubs.push_back(v);
  return hubs;
}

}  // namespace

void split_hubs(TriangleMesh& mesh) {
  constexpr int kPasses = 4;  // two hubs may share faces
  VertexFaces around(mesh.faces, mesh.vertices.size());
  std::vector<std::uint32_t> hubs = hubs_of(mesh, around);
  if (hubs.empty()) return;
  HubSplitter splitter(mesh);
  for (int pass = 0; pass < kPasses && !hubs.empty(); ++pass) {
    std::vector<bool> is_new(mesh.faces.size(), false);
    for (const std::uint32_t hub : hubs) splitter.split(hub, around.of(hub), is_new);
    around = VertexFaces(mesh.faces, mesh.vertices.size());
    hubs = hubs_of(mesh, around);
  }
  for (const std::uint32_t hub : hubs) {
    if (around.of(hub).size() <= kMostSpokes) continue;
    throw BadDataError("surface to decimate: " + std::to_string(around.of(hub).size()) +
                       " faces meet at one vertex and cannot be arranged otherwise; mesh it anew, "
                       "or use the method 'cluster'");
  }
}

}  // namespace organbake
