// SPDX-License-Identifier: Apache-2.0
#include "support/meshes.h"

#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "organbake/geometry/mesh_edges.h"
#include "organbake/geometry/refine.h"

namespace organbake {
TriangleMesh tetrahedron_mesh() {
  TriangleMesh m;
  m.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  m.faces = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  return m;
}

TriangleMesh box_mesh(const Eigen::Vector3d& size_mm) {
  TriangleMesh m;
  for (int i = 0; i < 8; ++i) {
    m.vertices.push_back(size_mm.cwiseProduct(Eigen::Vector3d(i & 1, i >> 1 & 1, i >> 2)));
  }
  m.faces = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
             {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return m;
}

TriangleMesh sphere_mesh(double radius_mm, int subdivisions) {
  return scaled(make_icosphere(subdivisions), radius_mm);
}

TriangleMesh lumpy_mesh(double radius_mm, int subdivisions) {
  TriangleMesh m = sphere_mesh(1, subdivisions);
  for (auto& v : m.vertices) {
    v *= radius_mm * (1 + 0.2 * v.x() + 0.15 * v.y() * v.z() + 0.1 * std::sin(3 * v.y() + v.x()) +
                      0.12 * v.z() * v.z() * v.z());
  }
  return m;
}

TriangleMesh grid_box(const Eigen::Vector3d& size_mm, int cells) {
  TriangleMesh mesh;
  std::map<std::array<int, 3>, std::uint32_t> known;
  const auto vertex = [&](const std::array<int, 3>& at) {
    const auto [found, added] = known.emplace(at, static_cast<std::uint32_t>(mesh.vertices.size()));
    if (added) {
      const Eigen::Vector3d share = Eigen::Vector3d(at[0], at[1], at[2]) / cells;
      mesh.vertices.push_back(size_mm.cwiseProduct(share - Eigen::Vector3d::Constant(0.5)));
    }
    return found->second;
  };
  for (int axis = 0; axis < 3; ++axis) {
    for (const int side : {0, cells}) {
      for (int cell = 0; cell < cells * cells; ++cell) {
        const auto at = [&](int di, int dj) {
          std::array<int, 3> corner{};
          corner[axis] = side;
          corner[(axis + 1) % 3] = cell / cells + di;
          corner[(axis + 2) % 3] = cell % cells + dj;
          return vertex(corner);
        };
        std::uint32_t a = at(0, 0), b = at(1, 0), c = at(1, 1), d = at(0, 1);
        if (side == 0) std::swap(b, d);
        mesh.faces.push_back({a, b, c});
        mesh.faces.push_back({a, c, d});
      }
    }
  }
  return mesh;
}

TriangleMesh cone_mesh(std::uint32_t sides) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 50}, {0, 0, 0}};
  for (std::uint32_t i = 0; i < sides; ++i) {
    const double angle = 2 * M_PI * i / sides;
    mesh.vertices.emplace_back(50 * std::cos(angle), 50 * std::sin(angle), 0);
    const std::uint32_t a = 2 + i, b = 2 + (i + 1) % sides;
    mesh.faces.push_back({0, a, b});
    mesh.faces.push_back({1, b, a});
  }
  return mesh;
}

TriangleMesh revolved_mesh(const std::vector<Eigen::Vector2d>& outline_mm, std::uint32_t sides) {
  TriangleMesh mesh;
  const auto rings = static_cast<std::uint32_t>(outline_mm.size() - 2);
  mesh.vertices = {{0, 0, outline_mm.front().y()}, {0, 0, outline_mm.back().y()}};
  for (std::uint32_t r = 0; r < rings; ++r)
    for (std::uint32_t i = 0; i < sides; ++i) {
      const double angle = 2 * M_PI * i / sides, radius = outline_mm[r + 1].x();
      mesh.vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle),
                                 outline_mm[r + 1].y());
    }
  const auto at = [&](std::uint32_t r, std::uint32_t i) { return 2 + r * sides + i % sides; };
  for (std::uint32_t i = 0; i < sides; ++i) {
    mesh.faces.push_back({0, at(0, i + 1), at(0, i)});
    mesh.faces.push_back({1, at(rings - 1, i), at(rings - 1, i + 1)});
    for (std::uint32_t r = 0; r + 1 < rings; ++r) {
      mesh.faces.push_back({at(r, i), at(r, i + 1), at(r + 1, i + 1)});
      mesh.faces.push_back({at(r, i), at(r + 1, i + 1), at(r + 1, i)});
    }
  }
  return mesh;
}

TriangleMesh torus_mesh(double circle_mm, double tube_mm, std::uint32_t around,
                        std::uint32_t across) {
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < around; ++i)
    for (std::uint32_t j = 0; j < across; ++j) {
      const double u = 2 * M_PI * i / around, v = 2 * M_PI * j / across;
      const double radius = circle_mm + tube_mm * std::cos(v);
      mesh.vertices.emplace_back(radius * std::cos(u), radius * std::sin(u), tube_mm * std::sin(v));
    }
  const auto at = [&](std::uint32_t i, std::uint32_t j) {
    return (i % around) * across + j % across;
  };
  for (std::uint32_t i = 0; i < around; ++i)
    for (std::uint32_t j = 0; j < across; ++j) {
      mesh.faces.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.faces.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return mesh;
}

TriangleMesh ball_with_stalk(double ball_mm, double stalk_mm, double length_mm) {
  constexpr int kBallSteps = 40, kStalkSteps = 40, kEndSteps = 8;
  constexpr std::uint32_t kSides = 48;
  const double end = std::asin(stalk_mm / ball_mm);  // where the stalk leaves, from the pole
  const double foot_mm = ball_mm * std::cos(end);
  std::vector<Eigen::Vector2d> outline;
  for (int i = 0; i <= kBallSteps; ++i) {
    const double angle = M_PI - (M_PI - end) * i / kBallSteps;
    outline.emplace_back(ball_mm * std::sin(angle), ball_mm * std::cos(angle));
  }
  for (int i = 1; i <= kStalkSteps; ++i)
    outline.emplace_back(stalk_mm, foot_mm + length_mm * i / kStalkSteps);
  for (int i = 1; i <= kEndSteps; ++i) {
    const double angle = 0.5 * M_PI * i / kEndSteps;
    outline.emplace_back(stalk_mm * std::cos(angle),
                         foot_mm + length_mm + stalk_mm * std::sin(angle));
  }
  return revolved_mesh(outline, kSides);
}

TriangleMesh moved(TriangleMesh mesh, const Eigen::Vector3d& by_mm) {
  for (Eigen::Vector3d& vertex : mesh.vertices) vertex += by_mm;
  return mesh;
}

TriangleMesh scaled(TriangleMesh mesh, double factor) {
  for (Eigen::Vector3d& vertex : mesh.vertices) vertex *= factor;
  return mesh;
}

TriangleMesh joined(TriangleMesh a, const TriangleMesh& b) {
  const auto offset = static_cast<std::uint32_t>(a.vertices.size());
  a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
  a.colors.insert(a.colors.end(), b.colors.begin(), b.colors.end());
  for (const Face& f : b.faces) a.faces.push_back({f[0] + offset, f[1] + offset, f[2] + offset});
  return a;
}

TriangleMesh inside_out(TriangleMesh mesh) {
  for (Face& face : mesh.faces) std::swap(face[1], face[2]);
  return mesh;
}

TriangleMesh mirrored(TriangleMesh mesh) {
  for (Eigen::Vector3d& vertex : mesh.vertices) vertex.x() = -vertex.x();
  return inside_out(std::move(mesh));
}

TriangleMesh soup_of(const TriangleMesh& mesh) {
  TriangleMesh soup;
  for (const Face& face : mesh.faces) {
    const auto first = static_cast<std::uint32_t>(soup.vertices.size());
    for (const std::uint32_t v : face) {
      soup.vertices.push_back(mesh.vertices[v]);
      if (!mesh.colors.empty()) soup.colors.push_back(mesh.colors[v]);
    }
    soup.faces.push_back({first, first + 1, first + 2});
  }
  return soup;
}

TriangleMesh cut_in_half(const TriangleMesh& mesh, const Eigen::Vector3d& normal,
                         double offset_mm) {
  const Eigen::Vector3d middle = bounds(mesh).center() + offset_mm * normal;
  TriangleMesh half = mesh;
  std::erase_if(half.faces, [&](const Face& face) {
    return std::any_of(face.begin(), face.end(), [&](std::uint32_t v) {
      return (mesh.vertices[v] - middle).dot(normal) < 0;
    });
  });
  return half;
}

SmoothSkin flat_skin(const TriangleMesh& proxy, std::uint32_t steps) {
  const Lattice lattice(proxy, steps);
  std::vector<std::array<double, 3>> weights(lattice.node_count());
  std::vector<std::uint32_t> face(lattice.node_count());
  for (std::uint32_t f = 0; f < proxy.faces.size(); ++f) {
    for (std::uint32_t i = 0; i <= steps; ++i) {
      for (std::uint32_t j = 0; i + j <= steps; ++j) {
        const double b1 = double(i) / steps, b2 = double(j) / steps;
        weights[lattice.node(f, i, j)] = {1 - b1 - b2, b1, b2};
        face[lattice.node(f, i, j)] = f;
      }
    }
  }
  SmoothSkin skin;
  skin.steps = steps;
  skin.first.push_back(0);
  for (std::uint32_t n = 0; n < lattice.node_count(); ++n) {
    for (int corner = 0; corner < 3; ++corner) {
      skin.carrier.push_back(proxy.faces[face[n]][corner]);
      skin.weight.push_back(weights[n][corner]);
    }
    skin.first.push_back(static_cast<std::uint32_t>(skin.carrier.size()));
  }
  return skin;
}

SmoothSkin spread_skin(const TriangleMesh& proxy, std::uint32_t steps, double share) {
  const SmoothSkin flat = flat_skin(proxy, steps);
  const VertexNeighbours neighbours(proxy.faces, proxy.vertices.size());
  SmoothSkin skin;
  skin.steps = steps;
  skin.first.push_back(0);
  for (std::size_t n = 0; n < flat.node_count(); ++n) {
    std::map<std::uint32_t, double> weights;
    for (std::uint32_t k = flat.first[n]; k < flat.first[n + 1]; ++k) {
      const auto around = neighbours.of(flat.carrier[k]);
      weights[flat.carrier[k]] += (1 - share) * flat.weight[k];
      for (const std::uint32_t v : around)
        weights[v] += share / double(around.size()) * flat.weight[k];
    }
    for (const auto& [vertex, weight] : weights) {
      skin.carrier.push_back(vertex);
      skin.weight.push_back(weight);
    }
    skin.first.push_back(static_cast<std::uint32_t>(skin.carrier.size()));
  }
  complete_weights(skin);
  return skin;
}

}  // namespace organbake
