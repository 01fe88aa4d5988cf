// SPDX-License-Identifier: GPL-3.0-or-later
// Springs as bars of tissue, and the struts and ties that a surface's own edges lack: without
// struts a closed net is a bag, which folds.
#include <suitesparse/cholmod.h>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <optional>

#include "organbake/core/union_find.h"
#include "organbake/raycast/ray_scene.h"
#include "tissue_parts.h"

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

// Columns from both sides fill the body twice, so each counts half.
constexpr double kShare = 0.5;
// Shares of the bounds' diagonal. A column must at least clear the faces it starts from.
constexpr double kStart = 1e-4;
constexpr double kLeastLength = 0.02;
constexpr double kLeastWeight = 0.05;  // corners that carry less are left out
constexpr double kLeastCosine = 0.7;   // of a vertex that passes as opposite

std::vector<RayHit> hits_opposite(const TriangleMesh& proxy,
                                  const std::vector<Eigen::Vector3d>& normals, double diagonal) {
  std::vector<Ray> rays(proxy.vertices.size());
  for (std::size_t v = 0; v < rays.size(); ++v) {
    rays[v] = {proxy.vertices[v], -normals[v], kStart * diagonal};
  }
  std::vector<RayHit> hits(rays.size());
  RayScene(proxy).first_hits(rays, hits);
  return hits;
}

std::optional<std::uint32_t> vertex_opposite(const TriangleMesh& proxy, std::uint32_t vertex,
                                             const Eigen::Vector3d& inward, double least_length,
                                             const std::vector<double>& vertex_area) {
  std::optional<std::uint32_t> best;
  double best_cosine = kLeastCosine;
  for (std::uint32_t other = 0; other < proxy.vertices.size(); ++other) {
    if (!(vertex_area[other] > 0)) continue;
    const Eigen::Vector3d way = proxy.vertices[other] - proxy.vertices[vertex];
    const double length = way.norm();
    if (length > least_length && way.dot(inward) / length > best_cosine) {
      best = other;
      best_cosine = way.dot(inward) / length;
    }
  }
  return best;
}

}  // namespace

SpringBuilder::SpringBuilder(const TriangleMesh& proxy, double young_modulus_kpa)
    : proxy_(proxy),
      modulus_n_per_mm2_(kNewtonPerMm2FromKpa * young_modulus_kpa),
      least_length_mm_(1e-6 * bounds(proxy).diagonal()) {}

bool SpringBuilder::add_bar(std::uint32_t a, std::uint32_t b, double cross_section_mm2) {
  const double length = (proxy_.vertices[a] - proxy_.vertices[b]).norm();
  if (!(length > least_length_mm_)) return false;
  stiffness_n_per_mm_[std::minmax(a, b)] += modulus_n_per_mm2_ * cross_section_mm2 / length;
  return true;
}

std::vector<Spring> SpringBuilder::springs(const std::vector<double>& mass_kg,
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

std::vector<std::uint32_t> SpringBuilder::parts() const {
  UnionFind parts(proxy_.vertices.size());
  for (const auto& [ends, stiffness] : stiffness_n_per_mm_) parts.join(ends.first, ends.second);
  return std::move(parts).roots();
}

void tie_loose_parts(const TriangleMesh& proxy, const std::vector<double>& vertex_area_mm2,
                     SpringBuilder& network) {
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

void add_body_struts(const TriangleMesh& proxy, const std::vector<double>& vertex_area_mm2,
                     SpringBuilder& network) {
  const double diagonal = bounds(proxy).diagonal();
  const std::vector<Eigen::Vector3d> normals = vertex_normals(proxy);
  const std::vector<RayHit> hits = hits_opposite(proxy, normals, diagonal);
  for (std::uint32_t v = 0; v < proxy.vertices.size(); ++v) {
    const double column = kShare * vertex_area_mm2[v];
    if (!(column > 0)) continue;  // no face, no column
    const RayHit& hit = hits[v];
    if (hit.face != kNoHit && hit.t > kLeastLength * diagonal &&
        !has_corner(proxy.faces[hit.face], v)) {
      const double weights[3] = {1.0 - hit.u - hit.v, hit.u, hit.v};
      for (int c = 0; c < 3; ++c) {
        if (weights[c] < kLeastWeight) continue;
        network.add_bar(v, proxy.faces[hit.face][c], column * weights[c]);
      }
    } else if (const auto other = vertex_opposite(proxy, v, -normals[v], kLeastLength * diagonal,
                                                  vertex_area_mm2)) {
      network.add_bar(v, *other, column);
    }
  }
}

// Nested dissection (METIS; Karypis & Kumar 1998) of a spring net, compared with minimum degree by
// CHOLMOD; the player has no METIS and takes the order from the bundle.
namespace {

using Matrix = Eigen::SparseMatrix<double>;

std::vector<std::uint32_t> free_vertices(const MechanicsModel& model) {
  std::vector<bool> anchored(model.mass_kg.size(), false);
  for (const std::uint32_t anchor : model.anchors) anchored[anchor] = true;
  std::vector<std::uint32_t> free;
  for (std::uint32_t v = 0; v < anchored.size(); ++v)
    if (!anchored[v]) free.push_back(v);
  return free;
}

// Upper half of a matrix with the pattern of masses and springs between free vertices.
Matrix pattern(const MechanicsModel& model, const std::vector<std::uint32_t>& free) {
  constexpr int kAnchored = -1;
  std::vector<int> column(model.mass_kg.size(), kAnchored);
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < static_cast<int>(free.size()); ++i) {
    column[free[i]] = i;
    entries.emplace_back(i, i, 1);
  }
  for (const Spring& s : model.springs) {
    const auto [row, later] = std::minmax(column[s.a], column[s.b]);
    if (row != kAnchored) entries.emplace_back(row, later, 1);
  }
  const auto n = static_cast<Eigen::Index>(free.size());
  Matrix matrix(n, n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

class Cholmod {
 public:
  Cholmod() {
    cholmod_start(&common_);
    common_.print = 0;
  }
  ~Cholmod() { cholmod_finish(&common_); }
  Cholmod(const Cholmod&) = delete;
  Cholmod& operator=(const Cholmod&) = delete;

  // Which column comes first, second, …, by nested dissection; empty where minimum degree leaves as
  // sparse a factor.
  std::vector<int> dissect(Matrix& upper) {
    cholmod_sparse view{};
    view.nrow = view.ncol = static_cast<std::size_t>(upper.cols());
    view.nzmax = static_cast<std::size_t>(upper.nonZeros());
    view.p = upper.outerIndexPtr(), view.i = upper.innerIndexPtr();
    view.stype = 1;  // its upper half
    view.itype = CHOLMOD_INT, view.xtype = CHOLMOD_PATTERN;
    view.sorted = view.packed = true;
    cholmod_factor* factor = cholmod_analyze(&view, &common_);
    if (factor == nullptr) throw std::bad_alloc();  // all that can go wrong with a pattern
    std::vector<int> order;
    if (factor->ordering == CHOLMOD_METIS) {
      const int* const first = static_cast<const int*>(factor->Perm);
      order.assign(first, first + upper.cols());
    }
    cholmod_free_factor(&factor, &common_);
    return order;
  }

 private:
  cholmod_common common_{};
};

}  // namespace

std::vector<std::uint32_t> elimination_order(const MechanicsModel& model) {
  const std::vector<std::uint32_t> free = free_vertices(model);
  if (free.empty()) return {};
  Matrix upper = pattern(model, free);
  std::vector<std::uint32_t> order;
  for (const int column : Cholmod().dissect(upper)) order.push_back(free[column]);
  return order;
}

}  // namespace organbake
