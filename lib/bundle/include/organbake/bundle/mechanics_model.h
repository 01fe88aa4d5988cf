// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
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

struct Spring {
  std::uint32_t a = 0, b = 0;     // proxy vertices
  double rest_length_mm = 0;      // > 0
  double stiffness_n_per_mm = 0;  // > 0
  double damping_n_s_per_mm = 0;  // ≥ 0
};

// The deformable part of a bundle: masses on the proxy's vertices, springs and dampers between
// them, anchors that don't move (the paper, 2.1.3). Written by the baker's mechanics stage.
struct MechanicsModel {
  std::vector<double> mass_kg;  // one per proxy vertex, > 0
  std::vector<Spring> springs;
  std::vector<std::uint32_t> anchors;  // fixed vertices, increasing
  // The other vertices in the order in which the player's factor best eliminates them; empty: the
  // player looks for one itself, slower and, for large proxies, worse.
  std::vector<std::uint32_t> elimination_order = {};
  double young_modulus_kpa = 0;  // the tissue constants that the springs were made from
  double density_kg_per_m3 = 0;
  double thickness_mm = 0;
  double volume_stiffness = 1;      // 0 = volume free, 1 = kept
  double instrument_radius_mm = 0;  // a default size for tools
  // What a grasp of the tissue holds, N: it slips from a larger pull. 0: it holds any, as in
  // bundles that do not say.
  double grasp_slip_n = 0;
  // How fast what hangs on no anchor loses its speed, 1/s: it lies in a wet cavity. 0: it coasts
  // on, as in bundles that do not say.
  double drag_per_s = 0;
  // How far the lips of a long cut stand apart that nothing pulls on, as skin is stretched at rest.
  double cut_gape_mm = 1.2;
  // The same tissue as finite elements, by which it is played unless springs are asked for.
  std::optional<TetrahedralBody> body = {};
};

std::string mechanics_to_json(const MechanicsModel& model);
// Throws BadDataError naming `name` and the key; vertex_count bounds every index.
MechanicsModel mechanics_from_json(const std::string& text, const std::string& name,
                                   std::size_t vertex_count);

}  // namespace organbake
