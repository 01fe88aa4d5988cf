// SPDX-License-Identifier: Apache-2.0
#include "unit/deform/test_bodies.h"

#include "organbake/core/random.h"
#include "organbake/geometry/mesh_edges.h"
#include "organbake/geometry/shell.h"
#include "support/testing.h"

namespace organbake::test {
namespace {

using Edge = std::pair<std::uint32_t, std::uint32_t>;

// Points that coincide on shared edges are found again by their rounded direction.
class UnitPoints {
 public:
  explicit UnitPoints(TriangleMesh& mesh) : mesh_(mesh) {}
  std::uint32_t add(const Eigen::Vector3d& point) {
    const Eigen::Vector3d unit = point.normalized();
    const std::array<long, 3> key = {std::lround(unit.x() * 1e6), std::lround(unit.y() * 1e6),
                                     std::lround(unit.z() * 1e6)};
    const auto [entry, made] =
        index_.try_emplace(key, static_cast<std::uint32_t>(mesh_.vertices.size()));
    if (made) mesh_.vertices.push_back(unit);
    return entry->second;
  }

 private:
  TriangleMesh& mesh_;
  std::map<std::array<long, 3>, std::uint32_t> index_;
};

std::uint32_t opposite(const TriangleMesh& mesh, const Eigen::Vector3d& center, std::uint32_t v) {
  const Eigen::Vector3d away = (center - mesh.vertices[v]).normalized();
  std::uint32_t best = v;
  double highest = -2;
  for (std::uint32_t w = 0; w < mesh.vertices.size(); ++w) {
    const double cosine = (mesh.vertices[w] - center).normalized().dot(away);
    if (cosine > highest) highest = cosine, best = w;
  }
  return best;
}

std::set<Edge> spring_pairs(const TriangleMesh& mesh) {
  std::set<Edge> pairs;
  const auto add = [&pairs](std::uint32_t a, std::uint32_t b) {
    if (a != b) pairs.insert(std::minmax(a, b));
  };
  MeshEdges(mesh).for_each([&](std::span<const EdgeUse> uses) {
    add(uses[0].low, uses[0].high);
    if (uses.size() != 2) return;
    const auto across = [&](const EdgeUse& use) {
      return mesh.faces[use.face()][use.opposite_corner() % 3];
    };
    add(across(uses[0]), across(uses[1]));
  });
  const Eigen::Vector3d center = bounds(mesh).center();
  for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) add(v, opposite(mesh, center, v));
  return pairs;
}

}  // namespace

TriangleMesh geodesic_sphere(int frequency, double radius_mm) {
  const TriangleMesh coarse = sphere_mesh(1, 0);
  TriangleMesh mesh;
  UnitPoints points(mesh);
  for (const Face& f : coarse.faces) {
    const auto grid = [&](int i, int j) {
      return points.add((frequency - i - j) * coarse.vertices[f[0]] + i * coarse.vertices[f[1]] +
                        j * coarse.vertices[f[2]]);
    };
    for (int i = 0; i < frequency; ++i) {
      for (int j = 0; i + j < frequency; ++j) {
        mesh.faces.push_back({grid(i, j), grid(i + 1, j), grid(i, j + 1)});
        if (i + j + 1 < frequency) {
          mesh.faces.push_back({grid(i + 1, j), grid(i + 1, j + 1), grid(i, j + 1)});
        }
      }
    }
  }
  for (auto& v : mesh.vertices) v *= radius_mm;
  return mesh;
}

TriangleMesh lumpy_organ(int frequency, double radius_mm, std::uint64_t seed) {
  TriangleMesh mesh = geodesic_sphere(frequency, radius_mm);
  RandomStream random(seed);
  for (int wave = 0; wave < 6; ++wave) {
    const Eigen::Vector3d direction(random.normal(), random.normal(), random.normal());
    const double phase = random.uniform(0, 6.28), height = random.uniform(0.02, 0.06);
    for (auto& v : mesh.vertices) {
      v *= 1 + height * std::sin(2 * direction.dot(v.normalized()) + phase);
    }
  }
  return mesh;
}

MechanicsModel spring_body(const TriangleMesh& mesh, const BodyOptions& options) {
  MechanicsModel model;
  const std::size_t n = mesh.vertices.size();
  const double kg_per_mm3 = options.density_kg_per_m3 * 1e-9;
  model.mass_kg.assign(n, std::abs(signed_volume(mesh)) * kg_per_mm3 / static_cast<double>(n));
  model.volume_stiffness = options.volume_stiffness;
  const double n_per_m = options.stiffness_n_per_mm * 1000;
  const double damper_n_s_per_m =
      2 * options.damping_ratio * std::sqrt(n_per_m * model.mass_kg[0] / 2);
  for (const auto& [a, b] : spring_pairs(mesh)) {
    model.springs.push_back({a, b, (mesh.vertices[a] - mesh.vertices[b]).norm(),
                             options.stiffness_n_per_mm, damper_n_s_per_m / 1000});
  }
  const Bounds box = bounds(mesh);
  const double radius = 0.5 * (box.max.z() - box.min.z());
  for (std::uint32_t v = 0; v < n; ++v) {
    if (mesh.vertices[v].z() - box.center().z() < options.anchored_below * radius) {
      model.anchors.push_back(v);
    }
  }
  return model;
}

BaseLayer sphere_base(const TriangleMesh& mesh, double radius_mm, std::uint32_t steps) {
  BaseLayer base;
  base.steps = steps;
  base.face_count = static_cast<std::uint32_t>(mesh.faces.size());
  const auto normals = vertex_normals(mesh);
  for (std::uint32_t f = 0; f < base.face_count; ++f) {
    const ShellMatrix m = shell_matrix(mesh, normals, f);
    for (std::uint32_t i = 0; i <= steps; ++i) {
      for (std::uint32_t j = 0; i + j <= steps; ++j) {
        const double b1 = double(i) / steps, b2 = double(j) / steps;
        double height = 0;
        for (int newton = 0; newton < 20; ++newton) {
          height += radius_mm - shell_point(m, b1, b2, height).norm();
        }
        base.height_mm.push_back(static_cast<float>(height));
      }
    }
  }
  return base;
}

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

BentTube bent_tube(double gap_rad) {
  constexpr int kRings = 25, kAround = 10;
  constexpr double kArc_mm = 30, kTube_mm = 8;
  BentTube tube;
  const auto ring_center = [&](int ring) {
    const double at = gap_rad / 2 + (2 * std::numbers::pi - gap_rad) * ring / (kRings - 1);
    return Eigen::Vector3d(std::cos(at), std::sin(at), 0);
  };
  for (int ring = 0; ring < kRings; ++ring) {
    const Eigen::Vector3d out = ring_center(ring);
    for (int k = 0; k < kAround; ++k) {
      const double turn = 2 * std::numbers::pi * k / kAround;
      tube.mesh.vertices.push_back(
          kArc_mm * out +
          kTube_mm * (std::cos(turn) * out + std::sin(turn) * Eigen::Vector3d::UnitZ()));
    }
  }
  const auto at = [](int ring, int k) {
    return static_cast<std::uint32_t>(ring * kAround + k % kAround);
  };
  auto& faces = tube.mesh.faces;
  for (int ring = 0; ring + 1 < kRings; ++ring) {
    for (int k = 0; k < kAround; ++k) {
      faces.push_back({at(ring, k), at(ring, k + 1), at(ring + 1, k)});
      faces.push_back({at(ring, k + 1), at(ring + 1, k + 1), at(ring + 1, k)});
    }
  }
  for (const int ring : {0, kRings - 1}) {
    const auto middle = static_cast<std::uint32_t>(tube.mesh.vertices.size());
    tube.mesh.vertices.push_back(kArc_mm * ring_center(ring));
    for (int k = 0; k < kAround; ++k) {
      const std::uint32_t p = at(ring, k), q = at(ring, k + 1);
      faces.push_back(ring == 0 ? Face{middle, q, p} : Face{middle, p, q});
    }
  }
  if (signed_volume(tube.mesh) < 0) {
    for (Face& f : faces) std::swap(f[1], f[2]);
  }
  tube.mechanics.mass_kg.assign(tube.mesh.vertices.size(), 1e-4);
  const auto spring = [&](std::uint32_t a, std::uint32_t b) {
    const double length = (tube.mesh.vertices[a] - tube.mesh.vertices[b]).norm();
    tube.mechanics.springs.push_back({a, b, length, 0.1, 5e-5});
  };
  for (const Face& f : faces) {
    for (int k = 0; k < 3; ++k)
      if (f[k] < f[(k + 1) % 3]) spring(f[k], f[(k + 1) % 3]);
  }
  for (int ring = 0; ring + 1 < kRings; ++ring) {
    for (int k = 0; k < kAround; ++k) spring(at(ring, k), at(ring + 1, k + kAround / 2));
  }
  for (int k = 0; k < kAround; ++k) tube.mechanics.anchors.push_back(at(kRings / 2, k));
  tube.mechanics.volume_stiffness = 1;
  return tube;
}

double farthest_between(const std::vector<Eigen::Vector3d>& a,
                        const std::vector<Eigen::Vector3d>& b) {
  double farthest = 0;
  for (std::size_t v = 0; v < a.size(); ++v) farthest = std::max(farthest, (a[v] - b[v]).norm());
  return farthest;
}

TriangleMesh posed(TriangleMesh mesh, const std::vector<Eigen::Vector3d>& vertices) {
  mesh.vertices = vertices;
  return mesh;
}

DeformOptions with_fem(double time_step_s) {
  DeformOptions options;
  options.solver = TissueSolver::fem;
  options.time_step_s = time_step_s;
  return options;
}

}  // namespace organbake::test
