// SPDX-License-Identifier: Apache-2.0
// Meshes made and made finer: spheres out of an icosahedron, edges halved by rounds, points spread
// over faces by their area, the nearest point of a triangle.
#include "organbake/geometry/refine.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <unordered_map>

#include "organbake/core/error.h"
#include "organbake/core/random.h"
#include "organbake/geometry/mesh_edges.h"

namespace organbake {
namespace {

constexpr int kMostSubdivisions = 9;

TriangleMesh icosahedron() {
  const double g = (1 + std::sqrt(5.0)) / 2;
  TriangleMesh mesh;
  mesh.vertices = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                   {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  for (auto& vertex : mesh.vertices) vertex.normalize();
  mesh.faces = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  return mesh;
}

// New vertices at the middles of edges, each one for both faces of its edge.
class Midpoints {
 public:
  explicit Midpoints(TriangleMesh& mesh) : mesh_(mesh) { known_.reserve(mesh.faces.size() * 2); }

  std::uint32_t of(std::uint32_t a, std::uint32_t b) {
    const auto next = static_cast<std::uint32_t>(mesh_.vertices.size());
    const auto [entry, is_new] = known_.try_emplace(edge_key(a, b), next);
    if (is_new) mesh_.vertices.push_back(0.5 * (mesh_.vertices[a] + mesh_.vertices[b]));
    return entry->second;
  }

 private:
  TriangleMesh& mesh_;
  std::unordered_map<std::uint64_t, std::uint32_t> known_;
};

}  // namespace

TriangleMesh make_icosphere(int subdivisions) {
  if (subdivisions < 0 || subdivisions > kMostSubdivisions)
    throw UsageError("subdivisions = " + std::to_string(subdivisions) + ": take 0…9");
  TriangleMesh mesh = icosahedron();
  for (int level = 0; level < subdivisions; ++level) {
    const std::size_t coarse = mesh.vertices.size();
    Midpoints midpoints(mesh);
    std::vector<Face> finer;
    finer.reserve(mesh.faces.size() * 4);
    for (const auto& [a, b, c] : mesh.faces) {
      const auto ab = midpoints.of(a, b), bc = midpoints.of(b, c), ca = midpoints.of(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    mesh.faces = std::move(finer);
    for (std::size_t v = coarse; v < mesh.vertices.size(); ++v) mesh.vertices[v].normalize();
  }
  return mesh;
}

// Edge subdivision by rounds: every edge that is too long is halved, and each face is cut by how
// many of its edges were. A face that shares an edge sees the same new vertex, so no round opens a
// gap.

namespace {

constexpr std::uint32_t kWhole = ~0u;  // an edge that is not split

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
    const std::vector<Eigen::Vector3d>& vertices = refined.mesh.vertices;
    Midpoints midpoints(refined.mesh);
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      return (vertices[a] - vertices[b]).norm() > longest_mm ? midpoints.of(a, b) : kWhole;
    };
    std::vector<Face> faces;
    std::vector<std::uint32_t> next_parents;
    faces.reserve(2 * refined.mesh.faces.size());
    next_parents.reserve(faces.capacity());
    for (std::size_t f = 0; f < refined.mesh.faces.size(); ++f) {
      const Face face = refined.mesh.faces[f];
      split(refined.mesh, face,
            {middle(face[0], face[1]), middle(face[1], face[2]), middle(face[2], face[0])}, faces);
      next_parents.resize(faces.size(), parents[f]);
      if (faces.size() > most_faces)
        throw UsageError("refine: edges of at most " + std::to_string(longest_mm) +
                         " mm would take more than " + std::to_string(most_faces) + " faces");
    }
    changed = faces.size() > refined.mesh.faces.size();
    refined.mesh.faces = std::move(faces);
    parents = std::move(next_parents);
  }
  refined.places = find_places(coarse, refined.mesh, parents);
  return refined;
}

namespace {

std::vector<double> cumulative_areas(const TriangleMesh& mesh) {
  std::vector<double> cumulative(mesh.faces.size());
  double sum = 0;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) cumulative[f] = sum += face_area(mesh, f);
  return cumulative;
}

}  // namespace

AreaSampler::AreaSampler(const TriangleMesh& mesh, std::size_t samples, std::uint64_t seed)
    : mesh_(mesh), cumulative_(cumulative_areas(mesh)), samples_(samples), seed_(seed) {
  if (mesh.empty() || !(cumulative_.back() > 0) || !std::isfinite(cumulative_.back()))
    throw BadDataError("mesh to measure from: its faces have no (finite) area");
}

AreaSampler::Sample AreaSampler::at(std::size_t i) const {
  RandomStream random(seed_, i);
  const double target = (i + random.uniform()) / samples_ * cumulative_.back();
  const auto found = std::upper_bound(cumulative_.begin(), cumulative_.end() - 1, target);
  const auto index = static_cast<std::uint32_t>(found - cumulative_.begin());
  const Face& face = mesh_.faces[index];
  const double r = std::sqrt(random.uniform()), s = random.uniform();
  const Eigen::Vector3d weights(1 - r, r * (1 - s), r * s);
  return {index, weights,
          weights[0] * mesh_.vertices[face[0]] + weights[1] * mesh_.vertices[face[1]] +
              weights[2] * mesh_.vertices[face[2]]};
}

namespace {

double ratio(double part, double whole) { return whole > 0 ? part / whole : 0; }

}  // namespace

Eigen::Vector3d nearest_on_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                    const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const Eigen::Vector3d ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};

  const double weight_c = d1 * d4 - d3 * d2;
  if (weight_c <= 0 && d1 >= 0 && d3 <= 0) {
    const double t = ratio(d1, d1 - d3);
    return {1 - t, t, 0};
  }
  const double weight_b = d5 * d2 - d1 * d6;
  if (weight_b <= 0 && d2 >= 0 && d6 <= 0) {
    const double t = ratio(d2, d2 - d6);
    return {1 - t, 0, t};
  }
  const double weight_a = d3 * d6 - d5 * d4;
  if (weight_a <= 0 && d4 >= d3 && d5 >= d6) {
    const double t = ratio(d4 - d3, (d4 - d3) + (d5 - d6));
    return {0, 1 - t, t};
  }
  const double sum = weight_a + weight_b + weight_c;
  const double b_weight = ratio(weight_b, sum), c_weight = ratio(weight_c, sum);
  return {1 - b_weight - c_weight, b_weight, c_weight};
}

}  // namespace organbake
