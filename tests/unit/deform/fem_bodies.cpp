// SPDX-License-Identifier: Apache-2.0
#include "unit/deform/fem_bodies.h"

#include <algorithm>
#include <array>
#include <map>

namespace organbake::test {
namespace {

void add_tetrahedron(std::array<std::uint32_t, 4> nodes, TetrahedralBody& body) {
  if (volume_of(body, {nodes}) < 0) std::swap(nodes[2], nodes[3]);
  body.tetrahedra.push_back({nodes});
}

// Three tetrahedra that meet their neighbours' whichever way round the faces are numbered.
void add_prism(Face outer, std::uint32_t to_inner, TetrahedralBody& body) {
  std::sort(outer.begin(), outer.end());
  const auto [a, b, c] = outer;
  add_tetrahedron({a, b, c, a + to_inner}, body);
  add_tetrahedron({b, c, a + to_inner, b + to_inner}, body);
  add_tetrahedron({c, a + to_inner, b + to_inner, c + to_inner}, body);
}

// Every proxy vertex is the node of the same number.
void embed_nodes(std::size_t vertices, TetrahedralBody& body) {
  body.vertices.resize(vertices);
  for (std::uint32_t t = 0; t < body.tetrahedra.size(); ++t) {
    for (int k = 0; k < 4; ++k) {
      const std::uint32_t n = body.tetrahedra[t].nodes[k];
      if (n >= vertices) continue;
      body.vertices[n] = {t, {}};
      body.vertices[n].weights[k] = 1;
    }
  }
}

std::vector<Face> outer_faces(const TetrahedralBody& body) {
  std::map<Face, std::vector<Face>> by_corners;
  for (const Tetrahedron& t : body.tetrahedra) {
    const auto& n = t.nodes;
    for (const Face& f : {Face{n[0], n[2], n[1]}, Face{n[0], n[1], n[3]}, Face{n[1], n[2], n[3]},
                          Face{n[2], n[0], n[3]}}) {
      Face key = f;
      std::sort(key.begin(), key.end());
      by_corners[key].push_back(f);
    }
  }
  std::vector<Face> faces;
  for (const auto& [key, same] : by_corners) {
    if (same.size() == 1) faces.push_back(same.front());
  }
  return faces;
}

MechanicsModel tissue(const FemOptions& options) {
  MechanicsModel model;
  model.young_modulus_kpa = options.young_modulus_kpa;
  model.density_kg_per_m3 = 1060;
  return model;
}

}  // namespace

MechanicsModel fem_ball(const TriangleMesh& mesh, const FemOptions& options) {
  MechanicsModel model = tissue(options);
  TetrahedralBody body;
  body.poisson_ratio = options.poisson_ratio;
  body.damping_s = options.damping_s;
  const Bounds box = bounds(mesh);
  const auto n = static_cast<std::uint32_t>(mesh.vertices.size());
  body.nodes_mm = mesh.vertices;
  for (const auto& v : mesh.vertices) body.nodes_mm.push_back(0.5 * (v + box.center()));
  body.nodes_mm.push_back(box.center());
  for (const Face& f : mesh.faces) {
    add_prism(f, n, body);
    add_tetrahedron({f[0] + n, f[1] + n, f[2] + n, 2 * n}, body);
  }
  embed_nodes(n, body);
  const double radius = 0.5 * (box.max.z() - box.min.z());
  for (std::uint32_t v = 0; v < n; ++v) {
    if (mesh.vertices[v].z() - box.center().z() < options.anchored_below * radius)
      body.anchors.push_back(v);
  }
  model.body = body;
  return model;
}

FemBar::FemBar(const FemOptions& options) : mechanics(tissue(options)) {
  TetrahedralBody body;
  body.poisson_ratio = options.poisson_ratio;
  body.damping_s = options.damping_s;
  const auto node = [this](const Eigen::Vector3i& at) {
    return std::uint32_t((at.z() * (cubes.y() + 1) + at.y()) * (cubes.x() + 1) + at.x());
  };
  for (int z = 0; z <= cubes.z(); ++z)
    for (int y = 0; y <= cubes.y(); ++y)
      for (int x = 0; x <= cubes.x(); ++x) {
        if (x == 0) body.anchors.push_back(node({x, y, z}));
        body.nodes_mm.push_back(cube_mm * Eigen::Vector3d(x, y, z));
      }
  for (int z = 0; z < cubes.z(); ++z)
    for (int y = 0; y < cubes.y(); ++y)
      for (int x = 0; x < cubes.x(); ++x) {
        std::array<int, 3> order = {0, 1, 2};  // Kuhn: one tetrahedron for each way to walk across
        do {
          Eigen::Vector3i at(x, y, z);
          std::array<std::uint32_t, 4> nodes{node(at)};
          for (int k = 0; k < 3; ++k) ++at[order[k]], nodes[k + 1] = node(at);
          add_tetrahedron(nodes, body);
        } while (std::next_permutation(order.begin(), order.end()));
      }
  embed_nodes(body.nodes_mm.size(), body);
  mesh.vertices = body.nodes_mm;
  mesh.faces = outer_faces(body);
  mechanics.body = body;
}

std::vector<double> FemBar::end_areas() const {
  std::vector<double> areas(mesh.vertices.size(), 0.0);
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    if (face_normal(mesh, f).x() < 0.5) continue;
    for (const std::uint32_t v : mesh.faces[f]) areas[v] += face_area(mesh, f) / 3;
  }
  return areas;
}

}  // namespace organbake::test
