// SPDX-License-Identifier: GPL-3.0-or-later
#include "spring_network.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace organbake {
namespace {

constexpr double kNewtonPerMm2FromKpa = 1e-3;  // 1 kPa = 1e3 N/m² = 1e-3 N/mm²
constexpr double kMmPerM = 1e3;

struct Neighbour {
  double distance = std::numeric_limits<double>::infinity();
  std::uint32_t inner = 0, outer = 0;
};

// For every vertex of the part the nearest vertex outside it, nearest pairs first. Quadratic, but
// proxies are small and loose parts few.
std::vector<Neighbour> neighbours_of_part(const TriangleMesh& proxy,
                                          const std::vector<std::uint32_t>& parts,
                                          const std::vector<double>& area, std::uint32_t part,
                                          double least_length) {
  std::vector<Neighbour> neighbours;
  for (std::uint32_t v = 0; v < parts.size(); ++v) {
    if (parts[v] != part || !(area[v] > 0)) continue;
    Neighbour nearest;
    for (std::uint32_t w = 0; w < parts.size(); ++w) {
      if (parts[w] == part || !(area[w] > 0)) continue;
      const double distance = (proxy.vertices[v] - proxy.vertices[w]).norm();
      if (distance > least_length && distance < nearest.distance) nearest = {distance, v, w};
    }
    if (std::isfinite(nearest.distance)) neighbours.push_back(nearest);
  }
  std::stable_sort(neighbours.begin(), neighbours.end(),
                   [](const auto& a, const auto& b) { return a.distance < b.distance; });
  return neighbours;
}

}  // namespace

SpringNetwork::SpringNetwork(const TriangleMesh& proxy, double young_modulus_kpa)
    : proxy_(proxy),
      modulus_n_per_mm2_(kNewtonPerMm2FromKpa * young_modulus_kpa),
      least_length_mm_(1e-6 * bounds(proxy).diagonal()) {}

bool SpringNetwork::add_bar(std::uint32_t a, std::uint32_t b, double cross_section_mm2) {
  const double length = (proxy_.vertices[a] - proxy_.vertices[b]).norm();
  if (!(length > least_length_mm_)) return false;
  stiffness_n_per_mm_[std::minmax(a, b)] += modulus_n_per_mm2_ * cross_section_mm2 / length;
  return true;
}

std::vector<Spring> SpringNetwork::springs(const std::vector<double>& mass_kg,
                                           double damping_ratio) const {
  std::vector<Spring> springs;
  springs.reserve(stiffness_n_per_mm_.size());
  for (const auto& [ends, stiffness] : stiffness_n_per_mm_) {
    const auto [a, b] = ends;
    const double reduced_mass = mass_kg[a] * mass_kg[b] / (mass_kg[a] + mass_kg[b]);
    // 2ζ√(km) in SI units, then N·s/m → N·s/mm.
    const double damping = 2 * damping_ratio * std::sqrt(stiffness * kMmPerM * reduced_mass);
    springs.push_back({.a = a,
                       .b = b,
                       .rest_length_mm = (proxy_.vertices[a] - proxy_.vertices[b]).norm(),
                       .stiffness_n_per_mm = stiffness,
                       .damping_n_s_per_mm = damping / kMmPerM});
  }
  return springs;
}

std::vector<std::uint32_t> SpringNetwork::parts() const {
  std::vector<std::uint32_t> parent(proxy_.vertices.size());
  std::iota(parent.begin(), parent.end(), 0u);
  const auto find = [&](std::uint32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (const auto& [ends, stiffness] : stiffness_n_per_mm_) {
    const std::uint32_t a = find(ends.first), b = find(ends.second);
    parent[std::max(a, b)] = std::min(a, b);
  }
  for (std::uint32_t v = 0; v < parent.size(); ++v) parent[v] = find(v);
  return parent;
}

void tie_loose_parts(const TriangleMesh& proxy, const std::vector<double>& vertex_area_mm2,
                     SpringNetwork& network) {
  const auto used = [&](std::size_t v) { return vertex_area_mm2[v] > 0; };
  for (bool tied = true; tied;) {
    const std::vector<std::uint32_t> parts = network.parts();
    std::size_t first = 0;
    while (first < parts.size() && !used(first)) ++first;
    std::size_t loose = first;
    while (loose < parts.size() && (!used(loose) || parts[loose] == parts[first])) ++loose;
    if (loose == parts.size()) return;
    // Every round leaves one part fewer, or finds that all the others lie in one point with it.
    tied = false;
    const auto ties =
        neighbours_of_part(proxy, parts, vertex_area_mm2, parts[loose], network.least_length_mm());
    for (std::size_t i = 0; i < std::min<std::size_t>(3, ties.size()); ++i) {
      tied |= network.add_bar(ties[i].inner, ties[i].outer, vertex_area_mm2[ties[i].inner]);
    }
  }
}

}  // namespace organbake
