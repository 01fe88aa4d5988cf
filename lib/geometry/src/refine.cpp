// SPDX-License-Identifier: Apache-2.0
// Edge subdivision by rounds: every edge that is too long is halved, and each face is cut by how
// many of its edges were. A face that shares an edge sees the same new vertex, so no round opens a
// gap.
#include "organbake/geometry/refine.h"

#include <cmath>
#include <string>
#include <unordered_map>

#include "organbake/core/error.h"
#include "organbake/geometry/mesh_edges.h"
#include "organbake/geometry/nearest_on_triangle.h"

namespace organbake {
namespace {

constexpr std::uint32_t kWhole = ~0u;  // an edge that is not split

// One round: every edge that is too long gets a vertex at its middle.
class EdgeSplitter {
 public:
  EdgeSplitter(TriangleMesh& mesh, double longest_mm) : mesh_(mesh), longest_mm_(longest_mm) {}

  std::uint32_t middle(std::uint32_t a, std::uint32_t b) {
    const Eigen::Vector3d va = mesh_.vertices[a], vb = mesh_.vertices[b];
    if (!((va - vb).norm() > longest_mm_)) return kWhole;
    const auto next = static_cast<std::uint32_t>(mesh_.vertices.size());
    const auto [found, added] = middles_.try_emplace(edge_key(a, b), next);
    if (added) mesh_.vertices.push_back(0.5 * (va + vb));
    return found->second;
  }

 private:
  TriangleMesh& mesh_;
  double longest_mm_;
  std::unordered_map<std::uint64_t, std::uint32_t> middles_;
};

// The faces that a face becomes. m[i] is the middle of the edge from corner i to the next.
void split(const TriangleMesh& mesh, const Face& f, const std::array<std::uint32_t, 3>& m,
           std::vector<Face>& out) {
  int cuts = 0;
  for (const std::uint32_t middle : m) cuts += middle != kWhole;
  if (cuts == 0) return out.push_back(f);
  if (cuts == 3) {
    out.insert(out.end(), {Face{f[0], m[0], m[2]}, Face{m[0], f[1], m[1]}, Face{m[2], m[1], f[2]},
                           Face{m[0], m[1], m[2]}});
    return;
  }
  // Turned so that edge 0 is cut and, of two cuts, the whole edge comes last or first after it.
  int i = 0;
  while (m[i] == kWhole || (cuts == 2 && m[(i + 1) % 3] == kWhole)) ++i;
  const std::uint32_t a = f[i], b = f[(i + 1) % 3], c = f[(i + 2) % 3], ab = m[i];
  if (cuts == 1) {
    out.insert(out.end(), {Face{a, ab, c}, Face{ab, b, c}});
    return;
  }
  const std::uint32_t bc = m[(i + 1) % 3];
  out.push_back({ab, b, bc});
  // The shorter diagonal of the quad that is left.
  if ((mesh.vertices[a] - mesh.vertices[bc]).norm() <
      (mesh.vertices[ab] - mesh.vertices[c]).norm()) {
    out.insert(out.end(), {Face{a, ab, bc}, Face{a, bc, c}});
  } else {
    out.insert(out.end(), {Face{a, ab, c}, Face{ab, bc, c}});
  }
}

std::vector<SurfacePlace> find_places(const TriangleMesh& coarse, const TriangleMesh& fine,
                                      const std::vector<std::uint32_t>& parents) {
  std::vector<SurfacePlace> places(fine.vertices.size());
  std::vector<char> known(fine.vertices.size(), 0);
  for (std::size_t f = 0; f < fine.faces.size(); ++f) {
    const Face& parent = coarse.faces[parents[f]];
    for (const std::uint32_t v : fine.faces[f]) {
      if (known[v]) continue;
      known[v] = 1;
      const Eigen::Vector3d weights =
          nearest_on_triangle(fine.vertices[v], coarse.vertices[parent[0]],
                              coarse.vertices[parent[1]], coarse.vertices[parent[2]]);
      places[v] = {parents[f], static_cast<float>(weights[1]), static_cast<float>(weights[2])};
    }
  }
  return places;
}

}  // namespace

RefinedMesh refine_edges(const TriangleMesh& coarse, double longest_mm, std::size_t most_faces) {
  if (!(longest_mm > 0)) throw UsageError("refine: the longest edge must be positive");
  RefinedMesh refined;
  refined.mesh.vertices = coarse.vertices;
  refined.mesh.faces = coarse.faces;
  std::vector<std::uint32_t> parents(coarse.faces.size());
  for (std::uint32_t f = 0; f < parents.size(); ++f) parents[f] = f;
  for (bool changed = true; changed;) {
    EdgeSplitter splitter(refined.mesh, longest_mm);
    std::vector<Face> faces;
    std::vector<std::uint32_t> next_parents;
    faces.reserve(2 * refined.mesh.faces.size());
    next_parents.reserve(faces.capacity());
    for (std::size_t f = 0; f < refined.mesh.faces.size(); ++f) {
      const Face face = refined.mesh.faces[f];
      split(refined.mesh, face,
            {splitter.middle(face[0], face[1]), splitter.middle(face[1], face[2]),
             splitter.middle(face[2], face[0])},
            faces);
      next_parents.resize(faces.size(), parents[f]);
      if (faces.size() > most_faces) {
        throw UsageError("refine: edges of at most " + std::to_string(longest_mm) +
                         " mm would take more than " + std::to_string(most_faces) + " faces");
      }
    }
    changed = faces.size() > refined.mesh.faces.size();
    refined.mesh.faces = std::move(faces);
    parents = std::move(next_parents);
  }
  refined.places = find_places(coarse, refined.mesh, parents);
  return refined;
}

}  // namespace organbake
