// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace organbake {

struct Tetrahedron {
  std::array<std::uint32_t, 4> nodes{};  // of positive volume: (b − a) × (c − a) · (d − a) > 0
  // Share of it that is tissue, 0 < fill ≤ 1: its stiffness and mass count by that much, so that a
  // body cut out of a lattice is as stiff and as heavy as the organ and not as its cells.
  double fill = 1;
};

// Where a proxy vertex lies in the tetrahedra: Σ weights · nodes, the weights 0…1 and of sum 1.
struct EmbeddedVertex {
  std::uint32_t tetrahedron = 0;
  std::array<double, 4> weights{};
};

// What a proxy vertex follows: a node, by a share of its motion.
struct NodeShare {
  std::uint32_t node;
  double weight;
};

// The organ as a solid of linear finite elements, the proxy embedded in it; the tissue's modulus
// and density are MechanicsModel's.
struct TetrahedralBody {
  std::vector<Eigen::Vector3d> nodes_mm;
  std::vector<Tetrahedron> tetrahedra;
  std::vector<EmbeddedVertex> vertices;  // one per proxy vertex
  // One per proxy vertex: the nodes under the patch of skin that it stands for, weights of sum 1,
  // by which it moves and hands on forces; Σ weights · nodes is the vertex. Empty, as in older
  // bundles and in cut organs: each moves with the tetrahedron in which it lies.
  std::vector<std::vector<NodeShare>> patches;
  // One per vertex of the proxy as it was baked, or empty, as in older bundles: by how much farther
  // what presses on it moves it than its patch, mm per N. A tool's tip is narrower than a patch,
  // and tetrahedra are too coarse to dent as sharply.
  std::vector<double> give_mm_per_n;
  // Of an organ that is cut: whose give each of its vertices follows, by its share (`node` is a
  // vertex as it was baked). Empty: each its own.
  std::vector<std::vector<NodeShare>> give_shares;
  std::vector<std::uint32_t> anchors;  // nodes that don't move, increasing
  double poisson_ratio = 0.45;         // 0…0.49; linear tetrahedra lock beyond
  double damping_s = 0;  // ≥ 0: a strain rate of 1/s acts as a strain of this does (Kelvin–Voigt)
};

// Where a node of a body that was cut or made finer lay before, by the nodes of the body as it was:
// Σ weights · nodes, of sum 1.
struct NodeSource {
  std::array<std::uint32_t, 4> nodes{};
  std::array<double, 4> weights{1, 0, 0, 0};
};

// Visits what a proxy vertex moves with, use(node, weight).
template <class Use>
void each_carrier(const TetrahedralBody& body, std::size_t vertex, Use&& use) {
  if (!body.patches.empty()) {
    for (const auto& [node, weight] : body.patches[vertex]) use(node, weight);
    return;
  }
  const auto& [tetrahedron, weights] = body.vertices[vertex];
  for (std::size_t k = 0; k < 4; ++k) use(body.tetrahedra[tetrahedron].nodes[k], weights[k]);
}

// Of one of its tetrahedra, mm³.
double volume_of(const TetrahedralBody& body, const Tetrahedron& tetrahedron);
// What each node carries, a quarter of each of its tetrahedra, kg.
std::vector<double> node_masses_kg(const TetrahedralBody& body, double density_kg_per_m3);
// Rows: ∇φ of its nodes' linear basis functions, 1/mm.
Eigen::Matrix<double, 4, 3> gradients_of(const TetrahedralBody& body,
                                         const Tetrahedron& tetrahedron);

}  // namespace organbake
