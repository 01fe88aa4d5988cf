// SPDX-License-Identifier: Apache-2.0
#include "deform/fem_body.h"

#include <Eigen/Dense>

#include "core/error.h"
#include "deform/element_stress.h"
#include "deform/mechanics_checks.h"
#include "deform/slots.h"

namespace organbake::deform {
namespace {

constexpr double kKgPerMm3 = 1e-9;  // per kg/m³
// Of A, against 3 of what W bends by at most (element_stress.h): steps along half the bound still
// lower the energy, and shorter ones would take longer.
constexpr double kBulkShare = 1.5;
// 1 kPa is 1 mN/mm², so moduli need no factor.

struct ElementShape {
  Eigen::Matrix<double, 4, 3> gradients;  // ∇φ of the corners, 1/mm
  double volume_mm3 = 0;                  // of tissue
};

ElementShape shape_of(const TetrahedralBody& body, const Tetrahedron& t) {
  return {gradients_of(body, t), t.fill * volume_of(body, t)};
}

struct Moduli {
  double shear, bulk;  // 2 μ and λ, mN/mm²
};

Moduli moduli_of(const MechanicsModel& mechanics) {
  const double e = mechanics.young_modulus_kpa, nu = mechanics.body->poisson_ratio;
  return {e / (1 + nu), e * nu / ((1 + nu) * (1 - 2 * nu))};
}

std::vector<double> node_masses(const MechanicsModel& mechanics) {
  const TetrahedralBody& body = *mechanics.body;
  std::vector<double> mass_kg(body.nodes_mm.size(), 0.0);
  for (const Tetrahedron& t : body.tetrahedra) {
    const double quarter = t.fill * volume_of(body, t) / 4;
    for (const std::uint32_t n : t.nodes)
      mass_kg[n] += kKgPerMm3 * mechanics.density_kg_per_m3 * quarter;
  }
  return mass_kg;
}

std::vector<Coefficient> matrix_of(const MechanicsModel& mechanics,
                                   const std::vector<double>& mass_kg, double time_step_s,
                                   const std::vector<std::uint32_t>& free_of_node) {
  std::vector<Coefficient> entries;
  for (std::size_t n = 0; n < mass_kg.size(); ++n) {
    const std::uint32_t i = free_of_node[n];
    if (i != kAnchored) entries.push_back({i, i, mass_kg[n] / (time_step_s * time_step_s)});
  }
  const Moduli moduli = moduli_of(mechanics);
  const double damped = 1 + mechanics.body->damping_s / time_step_s;
  for (const Tetrahedron& t : mechanics.body->tetrahedra) {
    const ElementShape shape = shape_of(*mechanics.body, t);
    const double weight = shape.volume_mm3 * (damped * moduli.shear + kBulkShare * moduli.bulk);
    for (int a = 0; a < 4; ++a) {
      for (int b = 0; b <= a; ++b) {
        const std::uint32_t i = free_of_node[t.nodes[a]], j = free_of_node[t.nodes[b]];
        if (i == kAnchored || j == kAnchored) continue;
        entries.push_back({i, j, weight * shape.gradients.row(a).dot(shape.gradients.row(b))});
      }
    }
  }
  return entries;
}

}  // namespace

FemBody::FemBody(const TriangleMesh& proxy, const MechanicsModel& mechanics, double time_step_s) {
  if (!mechanics.body) {
    throw UsageError(
        "this bundle has no tetrahedra for the solver fem; bake it with --set mechanics.fem=true, "
        "or use the solver springs");
  }
  check_tetrahedra(proxy, mechanics);
  const TetrahedralBody& body = *mechanics.body;
  damping_steps_ = body.damping_s / time_step_s;
  const std::vector<double> mass_kg = node_masses(mechanics);
  const auto free_of_node = number_free(body.nodes_mm.size(), body.anchors);
  factor_ = SparseFactor(count_free(free_of_node),
                         matrix_of(mechanics, mass_kg, time_step_s, free_of_node));
  place_slots(proxy, body, free_of_node);
  inertia_.resize(free_count());
  for (std::size_t n = 0; n < mass_kg.size(); ++n) {
    if (slot_of_node_[n] < free_count())
      inertia_[slot_of_node_[n]] = mass_kg[n] / (time_step_s * time_step_s);
  }
  place_elements(mechanics);
}

void FemBody::place_slots(const TriangleMesh& proxy, const TetrahedralBody& body,
                          const std::vector<std::uint32_t>& free_of_node) {
  const auto first_carried = static_cast<std::uint32_t>(free_count());
  const auto vertices = static_cast<std::uint32_t>(proxy.vertices.size());
  rest_.resize(body.nodes_mm.size() + vertices);
  std::uint32_t next_anchor = first_carried + vertices;
  for (std::size_t n = 0; n < body.nodes_mm.size(); ++n) {
    const std::uint32_t i = free_of_node[n];
    slot_of_node_.push_back(i == kAnchored ? next_anchor++ : factor_.position()[i]);
    rest_[slot_of_node_.back()] = to_row(body.nodes_mm[n]);
  }
  std::vector<CarriedPoint> carried;
  for (std::uint32_t v = 0; v < vertices; ++v) {
    const EmbeddedVertex& vertex = body.vertices[v];
    CarriedPoint point{{}, vertex.weights};
    for (int k = 0; k < 4; ++k)
      point.slots[k] = slot_of_node_[body.tetrahedra[vertex.tetrahedron].nodes[k]];
    carried.push_back(point);
    slot_of_vertex_.push_back(first_carried + v);
    rest_[first_carried + v] = to_row(proxy.vertices[v]);
  }
  embedding_ = Embedding(first_carried, std::move(carried));
  for (const Face& f : proxy.faces)
    faces_.push_back({slot_of_vertex_[f[0]], slot_of_vertex_[f[1]], slot_of_vertex_[f[2]]});
}

void FemBody::place_elements(const MechanicsModel& mechanics) {
  const auto& tetrahedra = mechanics.body->tetrahedra;
  const Moduli moduli = moduli_of(mechanics);
  blocks_.resize((tetrahedra.size() + 3) / 4);
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    for (std::size_t lane = 0; lane < 4; ++lane) {
      Block& block = blocks_[b];
      const bool real = 4 * b + lane < tetrahedra.size();
      const Tetrahedron& t = real ? tetrahedra[4 * b + lane] : tetrahedra.back();
      const ElementShape shape = shape_of(*mechanics.body, t);
      for (int k = 0; k < 4; ++k) block.slots[lane][k] = slot_of_node_[t.nodes[k]];
      for (int e = 0; e < 9; ++e) block.gradients[e][lane] = shape.gradients(1 + e / 3, e % 3);
      block.shear[lane] = real ? moduli.shear * shape.volume_mm3 : 0;
      block.bulk[lane] = real ? moduli.bulk * shape.volume_mm3 : 0;
    }
  }
}

// F = Σ x_k ∇φ_kᵀ of each element.
Matrices FemBody::deformation_of(const Block& block, const Lanes* at) {
  Matrices edges;  // column k: to corner k + 1
  for (int lane = 0; lane < 4; ++lane) {
    const auto& slots = block.slots[lane];
    for (int k = 0; k < 3; ++k) {
      const Lanes edge = at[slots[k + 1]] - at[slots[0]];
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
void FemBody::push(const Block& block, const Matrices& stress, Lanes* force) {
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
      const Lanes own = {on[3 * k][lane], on[3 * k + 1][lane], on[3 * k + 2][lane], 0};
      force[slots[k + 1]] += own;
      force[slots[0]] -= own;
    }
  }
}

void FemBody::local_step(const Rows& x, const Rows& x_start, const Rows& x_coasted,
                         Rows& force) const {
  const Lanes* at = as_lanes(x.data());
  const Lanes* from = as_lanes(x_start.data());
  Lanes* sum = as_lanes(force.data());
  put_inertia(x, x_coasted, force);
  Matrices stress;
  for (const Block& block : blocks_) {
    const Matrices f = deformation_of(block, at);
    const ElementStress element(f);
    element.stress(block.shear, block.bulk, stress);
    if (damping_steps_ > 0)
      element.add_viscous(damping_steps_ * block.shear, deformation_of(block, from), stress);
    push(block, stress, sum);
  }
  for (std::size_t i = free_count(); i < size(); ++i) sum[i] = Lanes{};
}

double FemBody::energy(const Rows& x, const Rows& x_start) const {
  const Lanes* at = as_lanes(x.data());
  double held = 0;
  for (const Block& block : blocks_) {
    const Matrices f = deformation_of(block, at);
    const Lanes energy = ElementStress(f).energy(block.shear, block.bulk);
    held += energy[0] + energy[1] + energy[2] + energy[3];
  }
  return twice_kinetic_energy(x, x_start) / 2 + held;
}

}  // namespace organbake::deform
