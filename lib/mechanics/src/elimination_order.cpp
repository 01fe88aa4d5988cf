// SPDX-License-Identifier: GPL-3.0-or-later
// Nested dissection (METIS; Karypis & Kumar 1998) of a spring net, compared with minimum degree by
// CHOLMOD; the player has no METIS and takes the order from the bundle.
#include "elimination_order.h"

#include <suitesparse/cholmod.h>

#include <Eigen/SparseCore>
#include <algorithm>
#include <new>

namespace organbake {
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
