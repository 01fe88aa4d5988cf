// SPDX-License-Identifier: Apache-2.0
// Springs, dampers and masses as projective dynamics has them (Bouaziz et al. 2014): the constant
// matrix, and local steps over springs that are sorted by their vertices and worked on in blocks.

#include <algorithm>
#include <numeric>

#include "body/tissue.h"

namespace organbake::deform {
namespace {

constexpr int kBlock = 64;
constexpr double kNoLength = 1e-300;  // mm²; keeps a spring between coincident vertices finite
// Below this a spring's length at rest counts as its rest length (mm): rounding of a written model.
constexpr double kRelaxedWithin_mm = 1e-4;

// The sum of the lanes of each of four.
Double4 sums(const Double4 (&v)[4]) {
  const auto pairs = [](const Double4& a, const Double4& b) {
    return __builtin_shufflevector(a, b, 0, 4, 2, 6) + __builtin_shufflevector(a, b, 1, 5, 3, 7);
  };
  const Double4 low = pairs(v[0], v[1]), high = pairs(v[2], v[3]);
  return __builtin_shufflevector(low, high, 0, 1, 4, 5) +
         __builtin_shufflevector(low, high, 2, 3, 6, 7);
}

// Numbers the points that an order has, each of them once, as it has them; others get kAnchored.
std::vector<std::uint32_t> number_free_in_order(std::size_t points,
                                                const std::vector<std::uint32_t>& order) {
  std::vector<std::uint32_t> free_of_point(points, kAnchored);
  std::uint32_t next = 0;
  for (const std::uint32_t point : order) free_of_point[point] = next++;
  return free_of_point;
}

}  // namespace

// All organs' springs as one net, the vertices of one after those of the other.
struct SpringNetwork::Net {
  Net(const DeformBodies& bodies, double stiffness) {
    for (const DeformBody& body : bodies) add(body.proxy, body.mechanics, stiffness);
  }

  void add(const TriangleMesh& proxy, const MechanicsModel& mechanics, double stiffness) {
    const auto first = static_cast<std::uint32_t>(vertices.size());
    vertices.insert(vertices.end(), proxy.vertices.begin(), proxy.vertices.end());
    organ_of_vertex.resize(vertices.size(), organs++);
    mass_kg.insert(mass_kg.end(), mechanics.mass_kg.begin(), mechanics.mass_kg.end());
    for (const Face& f : proxy.faces) faces.push_back({first + f[0], first + f[1], first + f[2]});
    for (const std::uint32_t anchor : mechanics.anchors) anchors.push_back(first + anchor);
    for (const std::uint32_t v : mechanics.elimination_order) order.push_back(first + v);
    for (Spring spring : mechanics.springs) {
      spring.a += first, spring.b += first;
      spring.stiffness_n_per_mm *= stiffness, spring.damping_n_s_per_mm *= stiffness;
      springs.push_back(spring);
    }
  }

  std::vector<Eigen::Vector3d> vertices;
  std::vector<Face> faces;
  std::vector<double> mass_kg;
  std::vector<Spring> springs;
  std::vector<std::uint32_t> anchors, organ_of_vertex;
  std::vector<std::uint32_t> order;  // to eliminate the free vertices in, of organs that have one
  std::uint32_t organs = 0;

  // Whether every organ has one.
  bool ordered() const { return order.size() + anchors.size() == vertices.size(); }
  std::vector<std::uint32_t> free_of_vertex() const {
    return ordered() ? number_free_in_order(vertices.size(), order)
                     : number_free(vertices.size(), anchors);
  }
};

SpringNetwork::SpringNetwork(const DeformBodies& bodies, double time_step_s, double stiffness) {
  const Net net(bodies, stiffness);
  const auto free_of_vertex = net.free_of_vertex();
  factor_ =
      SparseFactor(count_free(free_of_vertex), matrix_of_free(net, time_step_s, free_of_vertex),
                   net.ordered() ? UnknownOrder::given : UnknownOrder::to_be_found);
  place_slots(net, time_step_s, free_of_vertex);
  place_springs(net, time_step_s);
  find_parts(net);
}

std::vector<Coefficient> SpringNetwork::matrix_of_free(
    const Net& net, double time_step_s, const std::vector<std::uint32_t>& free_of_vertex) const {
  std::vector<Coefficient> entries;
  entries.reserve(net.mass_kg.size() + 3 * net.springs.size());
  for (std::size_t v = 0; v < free_of_vertex.size(); ++v) {
    const std::uint32_t i = free_of_vertex[v];
    if (i != kAnchored) entries.push_back({i, i, net.mass_kg[v] / (time_step_s * time_step_s)});
  }
  for (const Spring& s : net.springs) {
    const double weight =
        kMilliNewtonPerNewton * (s.stiffness_n_per_mm + s.damping_n_s_per_mm / time_step_s);
    const std::uint32_t a = free_of_vertex[s.a], b = free_of_vertex[s.b];
    if (a != kAnchored) entries.push_back({a, a, weight});
    if (b != kAnchored) entries.push_back({b, b, weight});
    if (a != kAnchored && b != kAnchored) entries.push_back({a, b, -weight});
  }
  return entries;
}

void SpringNetwork::place_slots(const Net& net, double time_step_s,
                                const std::vector<std::uint32_t>& free_of_vertex) {
  const std::size_t n = net.vertices.size();
  slot_of_vertex_.resize(n);
  rest_.resize(n);
  organ_of_slot_.resize(n);
  inertia_.resize(n);
  auto next_anchor = static_cast<std::uint32_t>(factor_.size());
  for (std::size_t v = 0; v < n; ++v) {
    const std::uint32_t i = free_of_vertex[v];
    const std::uint32_t slot = i == kAnchored ? next_anchor++ : factor_.position()[i];
    slot_of_vertex_[v] = slot;
    organ_of_slot_[slot] = net.organ_of_vertex[v];
    rest_[slot] = padded(net.vertices[v]);
    inertia_[slot] = net.mass_kg[v] / (time_step_s * time_step_s);
  }
  faces_.reserve(net.faces.size());
  for (const Face& f : net.faces) {
    faces_.push_back({slot_of_vertex_[f[0]], slot_of_vertex_[f[1]], slot_of_vertex_[f[2]]});
  }
}

void SpringNetwork::place_springs(const Net& net, double time_step_s) {
  std::vector<const Spring*> in_order;
  const auto ends_of = [this](const Spring& s) {
    const auto [a, b] = std::minmax(slot_of_vertex_[s.a], slot_of_vertex_[s.b]);
    return Ends{a, b};
  };
  for (const Spring& s : net.springs) {
    const Ends ends = ends_of(s);
    if (ends.a >= free_count()) continue;  // between two anchors
    in_order.push_back(&s);
    const double length = (rest_[ends.a] - rest_[ends.b]).norm();
    if (std::abs(length - s.rest_length_mm) > kRelaxedWithin_mm) relaxed_at_rest_ = false;
  }
  // In the order of slots the loop reads memory from front to back.
  std::stable_sort(in_order.begin(), in_order.end(), [&](const Spring* p, const Spring* q) {
    const Ends m = ends_of(*p), n = ends_of(*q);
    return m.a != n.a ? m.a < n.a : m.b < n.b;
  });
  for (const Spring* s : in_order) {
    ends_.push_back(ends_of(*s));
    length_.push_back(s->rest_length_mm);
    stiffness_.push_back(kMilliNewtonPerNewton * s->stiffness_n_per_mm);
    damper_.push_back(kMilliNewtonPerNewton * s->damping_n_s_per_mm / time_step_s);
  }
  if (ends_.empty()) return;
  const std::size_t whole = (ends_.size() + kBlock - 1) / kBlock * kBlock;
  ends_.resize(whole, ends_.back());
  for (auto* values : {&length_, &stiffness_, &damper_}) values->resize(whole, 0.0);
}

void SpringNetwork::find_parts(const Net& net) {
  std::vector<std::uint32_t> parent(size());
  std::iota(parent.begin(), parent.end(), 0u);
  const auto root = [&parent](std::uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  const auto join = [&](std::uint32_t a, std::uint32_t b) { parent[root(a)] = root(b); };
  for (const Spring& s : net.springs) join(slot_of_vertex_[s.a], slot_of_vertex_[s.b]);
  for (const Face& f : faces_) join(f[0], f[1]), join(f[1], f[2]);

  std::vector<std::uint32_t> part_of_root(size(), kAnchored);
  part_of_slot_.resize(size());
  for (const std::uint32_t slot : slot_of_vertex_) {
    std::uint32_t& part = part_of_root[root(slot)];
    if (part == kAnchored) part = part_count_++;
    part_of_slot_[slot] = part;
  }
  take_organs_for_pieces();
  bulk_energy_.assign(part_count_, 0.0);
  for (const Spring& s : net.springs) {
    bulk_energy_[part_of_slot_[slot_of_vertex_[s.a]]] +=
        kMilliNewtonPerNewton * s.stiffness_n_per_mm * s.rest_length_mm * s.rest_length_mm / 9;
  }
}

// Springs are worked on in blocks, so that roots and divisions are taken four at a time.
struct SpringNetwork::SpringBlock {
  using Values = Eigen::Array<double, kBlock, 1>;
  Double4 edge[kBlock];
  Values squared, along;  // |e|² and e · Δe, mm²
  Values extended;        // 1, or 0 where e is a stand-in for an edge of no length
  Values pull;            // on each spring's b, mN per mm of e
};

// The edge that a spring pulls along, its square and its product with the edge's change.
void SpringNetwork::measure_block(std::size_t begin, const Double4* at, const Double4* from,
                                  SpringBlock& block) const {
  for (int i = 0; i < kBlock; i += 4) {
    Double4 square[4], along[4];
    for (int k = 0; k < 4; ++k) {
      const auto [a, b] = ends_[begin + i + k];
      const Double4 edge = at[a] - at[b];
      block.edge[i + k] = edge;
      square[k] = edge * edge;
      along[k] = edge * (edge - (from[a] - from[b]));
    }
    *reinterpret_cast<Double4*>(block.squared.data() + i) = sums(square);
    *reinterpret_cast<Double4*>(block.along.data() + i) = sums(along);
  }
  block.extended.setOnes();
  if ((block.squared > 0).all()) return;
  for (int i = 0; i < kBlock; ++i) {
    if (!(block.squared[i] > 0)) stand_in(begin + i, from, block, i);
  }
}

// A spring collapsed to a point: only the rest shape knows a direction.
void SpringNetwork::stand_in(std::size_t spring, const Double4* from, SpringBlock& block,
                             int i) const {
  const auto [a, b] = ends_[spring];
  const Double4* at_rest = as_double4(rest_.data());
  const Double4 edge = at_rest[a] - at_rest[b];
  block.edge[i] = edge;
  block.extended[i] = 0;
  block.squared[i] = std::max(dot(edge, edge), kNoLength);
  block.along[i] = -dot(edge, from[a] - from[b]);
}

void SpringNetwork::pull_block(std::size_t begin, SpringBlock& block) const {
  const auto of = [begin](const std::vector<double>& values) {
    return Eigen::Map<const SpringBlock::Values>(values.data() + begin);
  };
  const SpringBlock::Values inverse_length = block.squared.sqrt().inverse();
  block.pull = of(stiffness_) * (block.extended - of(length_) * inverse_length) +
               of(damper_) * block.along * inverse_length * inverse_length;
}

void SpringNetwork::local_step(const PaddedVectors& x, const PaddedVectors& x_start,
                               const PaddedVectors& x_coasted, PaddedVectors& force) const {
  const Double4* at = as_double4(x.data());
  const Double4* from = as_double4(x_start.data());
  Double4* sum = as_double4(force.data());
  put_inertia(x, x_coasted, force);
  SpringBlock block;
  std::uint32_t slot = 0;
  Double4 on_slot{};  // springs run in order of a: its sum need not go through memory
  for (std::size_t begin = 0; begin < ends_.size(); begin += kBlock) {
    measure_block(begin, at, from, block);
    pull_block(begin, block);
    for (int i = 0; i < kBlock; ++i) {
      const auto [a, b] = ends_[begin + i];
      const Double4 on_b = block.pull[i] * block.edge[i];
      if (a != slot) {
        sum[slot] -= on_slot;
        on_slot = Double4{};
        slot = a;
      }
      on_slot += on_b;
      sum[b] += on_b;
    }
  }
  if (!ends_.empty()) sum[slot] -= on_slot;
}

double SpringNetwork::energy(const PaddedVectors& x, const PaddedVectors& x_start) const {
  const Double4* at = as_double4(x.data());
  double twice = twice_kinetic_energy(x, x_start);
  for (std::size_t i = 0; i < ends_.size(); ++i) {
    const Double4 edge = at[ends_[i].a] - at[ends_[i].b];
    const double stretch = std::sqrt(dot(edge, edge)) - length_[i];
    twice += stiffness_[i] * stretch * stretch;
  }
  return twice / 2;
}

}  // namespace organbake::deform
