// SPDX-License-Identifier: Apache-2.0
#include "deform/spring_network.h"

#include <algorithm>
#include <numeric>

#include "core/error.h"
#include "deform/mechanics_checks.h"

namespace organbake::deform {
namespace {

constexpr std::uint32_t kAnchored = 0xFFFFFFFFu;
constexpr int kBlock = 64;
constexpr double kNoLength = 1e-300;  // mm²; keeps a spring between coincident vertices finite
// Below this a spring's length at rest counts as its rest length (mm): rounding of a written model.
constexpr double kRelaxedWithin_mm = 1e-4;

std::vector<std::uint32_t> number_free(std::size_t vertices,
                                       const std::vector<std::uint32_t>& anchors) {
  std::vector<std::uint32_t> free_of_vertex(vertices, 0);
  for (const std::uint32_t anchor : anchors) free_of_vertex[anchor] = kAnchored;
  std::uint32_t next = 0;
  for (auto& index : free_of_vertex) {
    if (index != kAnchored) index = next++;
  }
  return free_of_vertex;
}

std::size_t count_free(const std::vector<std::uint32_t>& free_of_vertex) {
  return free_of_vertex.size() -
         std::count(free_of_vertex.begin(), free_of_vertex.end(), kAnchored);
}

}  // namespace

SpringNetwork::SpringNetwork(const TriangleMesh& proxy, const MechanicsModel& mechanics,
                             double time_step_s)
    : time_step_s_(time_step_s), factor_(0, {}) {
  check_mechanics(proxy, mechanics);
  const auto free_of_vertex = number_free(proxy.vertices.size(), mechanics.anchors);
  factor_ = SparseFactor(count_free(free_of_vertex),
                         matrix_of_free(mechanics, time_step_s, free_of_vertex));
  place_slots(proxy, mechanics, free_of_vertex);
  place_springs(mechanics, time_step_s);
  find_parts(mechanics);
}

std::vector<Coefficient> SpringNetwork::matrix_of_free(
    const MechanicsModel& mechanics, double time_step_s,
    const std::vector<std::uint32_t>& free_of_vertex) const {
  std::vector<Coefficient> entries;
  entries.reserve(mechanics.mass_kg.size() + 3 * mechanics.springs.size());
  for (std::size_t v = 0; v < free_of_vertex.size(); ++v) {
    const std::uint32_t i = free_of_vertex[v];
    if (i != kAnchored)
      entries.push_back({i, i, mechanics.mass_kg[v] / (time_step_s * time_step_s)});
  }
  for (const Spring& s : mechanics.springs) {
    const double weight =
        kMilliNewtonPerNewton * (s.stiffness_n_per_mm + s.damping_n_s_per_mm / time_step_s);
    const std::uint32_t a = free_of_vertex[s.a], b = free_of_vertex[s.b];
    if (a != kAnchored) entries.push_back({a, a, weight});
    if (b != kAnchored) entries.push_back({b, b, weight});
    if (a != kAnchored && b != kAnchored) entries.push_back({a, b, -weight});
  }
  return entries;
}

void SpringNetwork::place_slots(const TriangleMesh& proxy, const MechanicsModel& mechanics,
                                const std::vector<std::uint32_t>& free_of_vertex) {
  const std::size_t n = proxy.vertices.size();
  slot_of_vertex_.resize(n);
  rest_.resize(n);
  inertia_.resize(n);
  auto next_anchor = static_cast<std::uint32_t>(factor_.size());
  for (std::size_t v = 0; v < n; ++v) {
    const std::uint32_t i = free_of_vertex[v];
    const std::uint32_t slot = i == kAnchored ? next_anchor++ : factor_.position()[i];
    slot_of_vertex_[v] = slot;
    rest_[slot] = to_row(proxy.vertices[v]);
    inertia_[slot] = mechanics.mass_kg[v] / (time_step_s_ * time_step_s_);
  }
  faces_.reserve(proxy.faces.size());
  for (const Face& f : proxy.faces) {
    faces_.push_back({slot_of_vertex_[f[0]], slot_of_vertex_[f[1]], slot_of_vertex_[f[2]]});
  }
}

void SpringNetwork::place_springs(const MechanicsModel& mechanics, double time_step_s) {
  rest_load_.assign(size(), Row::Zero());
  for (const Spring& s : mechanics.springs) {
    const std::uint32_t a = slot_of_vertex_[s.a], b = slot_of_vertex_[s.b];
    if (std::min(a, b) >= free_count()) continue;  // between two anchors
    const double stiffness = kMilliNewtonPerNewton * s.stiffness_n_per_mm;
    springs_.push_back({a, b, s.rest_length_mm, stiffness,
                        kMilliNewtonPerNewton * s.damping_n_s_per_mm / time_step_s});
    const Row edge = rest_[a] - rest_[b];
    rest_load_[a] -= stiffness * edge;
    rest_load_[b] += stiffness * edge;
    if (std::abs(edge.norm() - s.rest_length_mm) > kRelaxedWithin_mm) relaxed_at_rest_ = false;
  }
  // In slot order, neighbours in memory are neighbours in the loop.
  std::sort(springs_.begin(), springs_.end(), [](const SlotSpring& p, const SlotSpring& q) {
    return std::minmax(p.a, p.b) < std::minmax(q.a, q.b);
  });
}

void SpringNetwork::find_parts(const MechanicsModel& mechanics) {
  std::vector<std::uint32_t> parent(size());
  std::iota(parent.begin(), parent.end(), 0u);
  const auto root = [&parent](std::uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  const auto join = [&](std::uint32_t a, std::uint32_t b) { parent[root(a)] = root(b); };
  for (const Spring& s : mechanics.springs) join(slot_of_vertex_[s.a], slot_of_vertex_[s.b]);
  for (const Face& f : faces_) join(f[0], f[1]), join(f[1], f[2]);

  std::vector<std::uint32_t> part_of_root(size(), kAnchored);
  part_of_slot_.resize(size());
  for (const std::uint32_t slot : slot_of_vertex_) {
    std::uint32_t& part = part_of_root[root(slot)];
    if (part == kAnchored) part = part_count_++;
    part_of_slot_[slot] = part;
  }
  bulk_energy_.assign(part_count_, 0.0);
  for (const Spring& s : mechanics.springs) {
    bulk_energy_[part_of_slot_[slot_of_vertex_[s.a]]] +=
        kMilliNewtonPerNewton * s.stiffness_n_per_mm * s.rest_length_mm * s.rest_length_mm / 9;
  }
}

void SpringNetwork::step_load(const Rows& u, const Rows& velocity, Rows& load) const {
  for (std::size_t i = 0; i < free_count(); ++i) {
    load[i] = rest_load_[i] + inertia_[i] * (u[i] + time_step_s_ * velocity[i]);
  }
  for (const SlotSpring& s : springs_) {
    if (s.damper == 0) continue;
    const Row pull = s.damper * (u[s.a] - u[s.b]);
    load[s.a] += pull;
    load[s.b] -= pull;
  }
}

void SpringNetwork::local_step(const Rows& x, const Rows& x_start, const Rows& load,
                               Rows& right_side) const {
  std::copy(load.begin(), load.end(), right_side.begin());
  const Lanes* at = as_lanes(x.data());
  const Lanes* from = as_lanes(x_start.data());
  const Lanes* at_rest = as_lanes(rest_.data());
  Lanes* sum = as_lanes(right_side.data());
  // In blocks, so that roots and divisions are taken four at a time.
  Lanes edge[kBlock];
  Eigen::Array<double, kBlock, 1> inverse_length = Eigen::Array<double, kBlock, 1>::Ones();
  for (std::size_t begin = 0; begin < springs_.size(); begin += kBlock) {
    const SlotSpring* block = springs_.data() + begin;
    const int count = static_cast<int>(std::min<std::size_t>(kBlock, springs_.size() - begin));
    for (int i = 0; i < count; ++i) {
      edge[i] = at[block[i].a] - at[block[i].b];
      double squared = dot(edge[i], edge[i]);
      if (!(squared > 0)) {  // collapsed to a point: only the rest shape knows a direction
        edge[i] = at_rest[block[i].a] - at_rest[block[i].b];
        squared = std::max(dot(edge[i], edge[i]), kNoLength);
      }
      inverse_length[i] = squared;
    }
    inverse_length = inverse_length.sqrt().inverse().eval();
    for (int i = 0; i < count; ++i) {
      const SlotSpring& s = block[i];
      const Lanes direction = inverse_length[i] * edge[i];
      const Lanes move = edge[i] - (from[s.a] - from[s.b]);
      const double along = dot(move, direction);
      const Lanes pull = (s.stiffness * s.length - s.damper * along) * direction + s.damper * move;
      sum[s.a] += pull;
      sum[s.b] -= pull;
    }
  }
}

double SpringNetwork::energy(const Rows& x, const Rows& x_start) const {
  const Lanes* at = as_lanes(x.data());
  const Lanes* from = as_lanes(x_start.data());
  double twice = 0;
  for (std::size_t i = 0; i < free_count(); ++i) {
    const Lanes move = at[i] - from[i];
    twice += inertia_[i] * dot(move, move);
  }
  for (const SlotSpring& s : springs_) {
    const Lanes edge = at[s.a] - at[s.b];
    const double stretch = std::sqrt(dot(edge, edge)) - s.length;
    twice += s.stiffness * stretch * stretch;
  }
  return twice / 2;
}

}  // namespace organbake::deform
