// SPDX-License-Identifier: Apache-2.0
// Tissue as linear corotational finite elements (Müller & Gross 2004; the energy of Chao et al.
// 2010). In: the tetrahedra of one organ or several. Out: the constant matrix, factored once, and
// in each local step the forces that are left, by blocks of four elements.

#include <Eigen/Dense>
#include <map>

#include "body/tissue.h"
#include "organbake/core/error.h"
#include "organbake/core/union_find.h"

namespace organbake::deform {
namespace {

constexpr double kKgPerMm3 = 1e-9;  // per kg/m³
// Of A, against 3 of what W bends by at most (element_stress.h): steps along half the bound still
// lower the energy, and shorter ones would take longer.
constexpr double kBulkShare = 1.5;
// 1 kPa is 1 mN/mm², so moduli need no factor.

struct Moduli {
  double shear, bulk;  // 2 μ and λ, mN/mm²
};

Moduli moduli_of(const MechanicsModel& mechanics, double stiffness) {
  const double e = stiffness * mechanics.young_modulus_kpa, nu = mechanics.body->poisson_ratio;
  return {e / (1 + nu), e * nu / ((1 + nu) * (1 - 2 * nu))};
}

struct Element {
  std::array<std::uint32_t, 4> nodes{};
  Eigen::Matrix<double, 4, 3> gradients;  // ∇φ of the corners, 1/mm
  double shear = 0, bulk = 0;             // 2 μ V and λ V of its tissue, mN·mm
  double damping_steps = 0;               // the damping in time steps
  double mass_kg = 0;
};

}  // namespace

// All organs' tetrahedra as one solid, the nodes of one after those of the other.
struct FemBody::Solid {
  Solid(const DeformBodies& bodies, double time_step_s, double stiffness) {
    for (const DeformBody& body : bodies) add(body.proxy, body.mechanics, time_step_s, stiffness);
  }

  void add(const TriangleMesh& proxy, const MechanicsModel& mechanics, double time_step_s,
           double stiffness);
  void add_give(const TetrahedralBody& body, double time_step_s, double stiffness);
  std::vector<double> node_masses_kg() const;
  std::vector<Coefficient> matrix(double time_step_s,
                                  const std::vector<std::uint32_t>& free_of_node) const;

  std::vector<Eigen::Vector3d> nodes_mm;
  std::vector<Element> elements;
  std::vector<std::uint32_t> anchors;
  std::vector<Eigen::Vector3d> vertices_mm;
  std::vector<std::vector<Carrier>> carried;  // the vertices, by nodes
  std::vector<SkinGive::Place> gives;
  std::vector<std::vector<Carrier>> give_shares;  // of the vertices, by gives
  std::vector<Face> faces;                        // of vertices
  std::vector<std::uint32_t> organ_of_node, organ_of_vertex;
  std::uint32_t organs = 0;
};

void FemBody::Solid::add(const TriangleMesh& proxy, const MechanicsModel& mechanics,
                         double time_step_s, double stiffness) {
  if (!mechanics.body) {
    throw UsageError(
        "this bundle has no tetrahedra for the solver fem; bake it anew without --set "
        "mechanics.fem=false, or use the solver springs");
  }
  const TetrahedralBody& body = *mechanics.body;
  const auto first_node = static_cast<std::uint32_t>(nodes_mm.size());
  const auto first_vertex = static_cast<std::uint32_t>(vertices_mm.size());
  const auto nodes_of = [first_node](const Tetrahedron& t) {
    auto nodes = t.nodes;
    for (std::uint32_t& n : nodes) n += first_node;
    return nodes;
  };
  nodes_mm.insert(nodes_mm.end(), body.nodes_mm.begin(), body.nodes_mm.end());
  vertices_mm.insert(vertices_mm.end(), proxy.vertices.begin(), proxy.vertices.end());
  for (const std::uint32_t anchor : body.anchors) anchors.push_back(first_node + anchor);
  const Moduli moduli = moduli_of(mechanics, stiffness);
  for (const Tetrahedron& t : body.tetrahedra) {
    const double volume_mm3 = t.fill * volume_of(body, t);
    elements.push_back({nodes_of(t), gradients_of(body, t), moduli.shear * volume_mm3,
                        moduli.bulk * volume_mm3, body.damping_s / time_step_s,
                        kKgPerMm3 * mechanics.density_kg_per_m3 * volume_mm3});
  }
  for (std::size_t v = 0; v < proxy.vertices.size(); ++v) {
    std::vector<Carrier>& carriers = carried.emplace_back();
    each_carrier(body, v, [&](std::uint32_t node, double weight) {
      carriers.push_back({first_node + node, weight});
    });
  }
  add_give(body, time_step_s, stiffness);
  for (const Face& f : proxy.faces)
    faces.push_back({first_vertex + f[0], first_vertex + f[1], first_vertex + f[2]});
  organ_of_node.resize(nodes_mm.size(), organs);
  organ_of_vertex.resize(vertices_mm.size(), organs);
  ++organs;
}

// Adds the skin's own springs, damped as the tissue is (Kelvin and Voigt), for an implicit step.
void FemBody::Solid::add_give(const TetrahedralBody& body, double time_step_s, double stiffness) {
  const auto first = static_cast<std::uint32_t>(gives.size());
  const double damping_steps = body.damping_s / time_step_s;
  for (const double mm_per_n : body.give_mm_per_n)
    gives.push_back({mm_per_n / stiffness / kMilliNewtonPerNewton / (1 + damping_steps),
                     damping_steps / (1 + damping_steps)});
  for (std::uint32_t v = 0; v < body.vertices.size(); ++v) {
    std::vector<Carrier>& shares = give_shares.emplace_back();
    if (body.give_mm_per_n.empty()) continue;
    if (body.give_shares.empty()) shares.push_back({first + v, 1});
    for (std::size_t k = 0; !body.give_shares.empty() && k < body.give_shares[v].size(); ++k)
      shares.push_back({first + body.give_shares[v][k].node, body.give_shares[v][k].weight});
  }
}

std::vector<double> FemBody::Solid::node_masses_kg() const {
  std::vector<double> mass_kg(nodes_mm.size(), 0.0);
  for (const Element& element : elements) {
    for (const std::uint32_t n : element.nodes) mass_kg[n] += element.mass_kg / 4;
  }
  return mass_kg;
}

std::vector<Coefficient> FemBody::Solid::matrix(
    double time_step_s, const std::vector<std::uint32_t>& free_of_node) const {
  std::vector<Coefficient> entries;
  const std::vector<double> mass_kg = node_masses_kg();
  for (std::size_t n = 0; n < mass_kg.size(); ++n) {
    const std::uint32_t i = free_of_node[n];
    if (i != kAnchored) entries.push_back({i, i, mass_kg[n] / (time_step_s * time_step_s)});
  }
  for (const Element& element : elements) {
    const double weight = (1 + element.damping_steps) * element.shear + kBulkShare * element.bulk;
    for (int a = 0; a < 4; ++a) {
      for (int b = 0; b <= a; ++b) {
        const std::uint32_t i = free_of_node[element.nodes[a]], j = free_of_node[element.nodes[b]];
        if (i == kAnchored || j == kAnchored) continue;
        entries.push_back({i, j, weight * element.gradients.row(a).dot(element.gradients.row(b))});
      }
    }
  }
  return entries;
}

FemBody::FemBody(const DeformBodies& bodies, double time_step_s, double stiffness) {
  const Solid solid(bodies, time_step_s, stiffness);
  const auto free_of_node = number_free(solid.nodes_mm.size(), solid.anchors);
  factor_ = SparseFactor(count_free(free_of_node), solid.matrix(time_step_s, free_of_node));
  place_slots(solid, free_of_node);
  inertia_.resize(free_count());
  const std::vector<double> mass_kg = solid.node_masses_kg();
  for (std::size_t n = 0; n < mass_kg.size(); ++n) {
    if (slot_of_node_[n] < free_count())
      inertia_[slot_of_node_[n]] = mass_kg[n] / (time_step_s * time_step_s);
  }
  place_elements(solid);
  find_pieces(solid, bodies);
}

// Of an organ that blades have cut: what hangs together by its tetrahedra and has skin of its own,
// which the core of a needle's hole has not. The first piece keeps
// the organ's number, the others follow the last organ.
void FemBody::find_pieces(const Solid& solid, const DeformBodies& bodies) {
  take_organs_for_pieces();
  const auto is_cut = [&](std::uint32_t organ) {
    return bodies[organ].skin && !bodies[organ].skin->creased.empty();
  };
  UnionFind joined(solid.nodes_mm.size());
  for (const Element& element : solid.elements)
    for (const std::uint32_t node : element.nodes) joined.join(element.nodes[0], node);
  const std::vector<std::uint32_t> root = std::move(joined).roots();
  std::vector<std::uint8_t> has_skin(root.size(), 0);  // by root
  const auto root_under = [&](std::uint32_t vertex) {
    return root[solid.carried[vertex].front().slot];
  };
  std::uint32_t first_vertex = 0;
  for (const DeformBody& body : bodies) {
    for (const Face& f : body.proxy.faces) {
      const bool beside_cut =
          body.skin && (body.skin->is_creased(f[0]) || body.skin->is_creased(f[1]) ||
                        body.skin->is_creased(f[2]));
      if (!beside_cut) has_skin[root_under(first_vertex + f[0])] = 1;
    }
    first_vertex += static_cast<std::uint32_t>(body.proxy.vertices.size());
  }
  std::map<std::uint32_t, std::uint32_t> piece_of_root;
  std::vector<std::uint8_t> organ_taken(pieces_.size(), 0);
  for (std::uint32_t n = 0; n < root.size(); ++n) {
    const std::uint32_t organ = solid.organ_of_node[n];
    if (!is_cut(organ)) continue;
    pieces_[organ].cut = true;
    if (!has_skin[root[n]]) continue;
    const auto [known, made] = piece_of_root.try_emplace(root[n], organ);
    if (made && organ_taken[organ]) {
      known->second = static_cast<std::uint32_t>(pieces_.size());
      pieces_.emplace_back();
    }
    if (made) organ_taken[organ] = 1, pieces_[known->second] = {true, false, organ};
    piece_of_slot_[slot_of_node_[n]] = known->second;
  }
  for (const std::uint32_t anchor : solid.anchors)
    pieces_[piece_of_slot_[slot_of_node_[anchor]]].held = true;
  for (std::size_t v = 0; v < slot_of_vertex_.size(); ++v)
    piece_of_slot_[slot_of_vertex_[v]] =
        piece_of_slot_[slot_of_node_[solid.carried[v].front().slot]];
}

void FemBody::place_slots(const Solid& solid, const std::vector<std::uint32_t>& free_of_node) {
  const auto first_carried = static_cast<std::uint32_t>(free_count());
  const auto vertices = static_cast<std::uint32_t>(solid.vertices_mm.size());
  rest_.resize(solid.nodes_mm.size() + vertices);
  organ_of_slot_.resize(rest_.size());
  std::uint32_t next_anchor = first_carried + vertices;
  for (std::size_t n = 0; n < solid.nodes_mm.size(); ++n) {
    const std::uint32_t i = free_of_node[n];
    const std::uint32_t slot = i == kAnchored ? next_anchor++ : factor_.position()[i];
    slot_of_node_.push_back(slot);
    rest_[slot] = padded(solid.nodes_mm[n]);
    organ_of_slot_[slot] = solid.organ_of_node[n];
  }
  std::vector<std::vector<Carrier>> carried = solid.carried;
  for (std::uint32_t v = 0; v < vertices; ++v) {
    for (Carrier& carrier : carried[v]) carrier.slot = slot_of_node_[carrier.slot];
    slot_of_vertex_.push_back(first_carried + v);
    rest_[first_carried + v] = padded(solid.vertices_mm[v]);
    organ_of_slot_[first_carried + v] = solid.organ_of_vertex[v];
  }
  embedding_ = Embedding(first_carried, carried);
  give_ = SkinGive(first_carried, solid.gives, solid.give_shares);
  for (const Face& f : solid.faces)
    faces_.push_back({slot_of_vertex_[f[0]], slot_of_vertex_[f[1]], slot_of_vertex_[f[2]]});
}

void FemBody::place_elements(const Solid& solid) {
  blocks_.resize((solid.elements.size() + 3) / 4);
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    for (std::size_t lane = 0; lane < 4; ++lane) {
      Block& block = blocks_[b];
      const bool real = 4 * b + lane < solid.elements.size();
      const Element& element = real ? solid.elements[4 * b + lane] : solid.elements.back();
      for (int k = 0; k < 4; ++k) block.slots[lane][k] = slot_of_node_[element.nodes[k]];
      for (int e = 0; e < 9; ++e) block.gradients[e][lane] = element.gradients(1 + e / 3, e % 3);
      block.shear[lane] = real ? element.shear : 0;
      block.bulk[lane] = real ? element.bulk : 0;
      block.viscous[lane] = element.damping_steps * block.shear[lane];
      damped_ = damped_ || element.damping_steps > 0;
    }
  }
}

// F = Σ x_k ∇φ_kᵀ of each element.
Matrices FemBody::deformation_of(const Block& block, const Double4* at) {
  Matrices edges;  // column k: to corner k + 1
  for (int lane = 0; lane < 4; ++lane) {
    const auto& slots = block.slots[lane];
    for (int k = 0; k < 3; ++k) {
      const Double4 edge = at[slots[k + 1]] - at[slots[0]];
      for (int i = 0; i < 3; ++i) edges[3 * i + k][lane] = edge[i];
    }
  }
  Matrices f;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      f[3 * i + j] = edges[3 * i] * block.gradients[j] + edges[3 * i + 1] * block.gradients[3 + j] +
                     edges[3 * i + 2] * block.gradients[6 + j];
    }
  }
  return f;
}

// The force on corner k is −P ∇φ_k, and all four sum up to nothing.
void FemBody::push(const Block& block, const Matrices& stress, Double4* force) {
  Matrices on;  // row k: on corner k + 1
  for (int k = 0; k < 3; ++k) {
    for (int i = 0; i < 3; ++i) {
      on[3 * k + i] = -(stress[3 * i] * block.gradients[3 * k] +
                        stress[3 * i + 1] * block.gradients[3 * k + 1] +
                        stress[3 * i + 2] * block.gradients[3 * k + 2]);
    }
  }
  for (int lane = 0; lane < 4; ++lane) {
    const auto& slots = block.slots[lane];
    for (int k = 0; k < 3; ++k) {
      const Double4 own = {on[3 * k][lane], on[3 * k + 1][lane], on[3 * k + 2][lane], 0};
      force[slots[k + 1]] += own;
      force[slots[0]] -= own;
    }
  }
}

void FemBody::local_step(const PaddedVectors& x, const PaddedVectors& x_start,
                         const PaddedVectors& x_coasted, PaddedVectors& force) const {
  const Double4* at = as_double4(x.data());
  const Double4* from = as_double4(x_start.data());
  Double4* sum = as_double4(force.data());
  put_inertia(x, x_coasted, force);
  Matrices stress;
  for (const Block& block : blocks_) {
    const Matrices f = deformation_of(block, at);
    const ElementStress element(f);
    element.stress(block.shear, block.bulk, stress);
    if (damped_) element.add_viscous(block.viscous, deformation_of(block, from), stress);
    push(block, stress, sum);
  }
  for (std::size_t i = free_count(); i < size(); ++i) sum[i] = Double4{};
}

double FemBody::energy(const PaddedVectors& x, const PaddedVectors& x_start) const {
  const Double4* at = as_double4(x.data());
  double held = 0;
  for (const Block& block : blocks_) {
    const Matrices f = deformation_of(block, at);
    const Double4 energy = ElementStress(f).energy(block.shear, block.bulk);
    held += energy[0] + energy[1] + energy[2] + energy[3];
  }
  return twice_kinetic_energy(x, x_start) / 2 + held;
}

}  // namespace organbake::deform
