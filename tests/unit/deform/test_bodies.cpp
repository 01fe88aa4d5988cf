// SPDX-License-Identifier: Apache-2.0
#include "unit/deform/test_bodies.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "organbake/core/random.h"
#include "organbake/geometry/mesh_edges.h"
#include "organbake/geometry/shell_map.h"

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

}  // namespace organbake::test
