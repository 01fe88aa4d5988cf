// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "contact/padded_vector.h"
#include "solver/panel_kernels.h"

namespace organbake::deform {

struct FactorPanel;

// One entry of a symmetric matrix, given once for (i, j) and (j, i); repeated entries add up.
struct Coefficient {
  std::uint32_t i = 0, j = 0;
  double value = 0;
};

// Whether the unknowns come in a good elimination order already, or one has to be found (AMD).
enum class UnknownOrder { to_be_found, given };

// Sparse L D Lᵀ of a symmetric positive definite matrix, made once, and back-substitution on
// several right sides at a time. Columns of L with the same pattern are kept as dense panels
// (supernodes; Ng & Peyton 1993), so that the inner loops are plain dense products.
//
// Factorised in double precision, kept and solved in single: a solve moves the whole factor
// through the caches, and half the bytes are twice the speed. Errors are about 1e-6 of the
// solution; who needs more solves for what is left (ShapeSolver does: its right sides are forces
// that are left, its solutions corrections).
class SparseFactor {
 public:
  // Throws BadDataError when the matrix is not positive definite in double precision.
  SparseFactor(std::size_t size, const std::vector<Coefficient>& coefficients,
               UnknownOrder order = UnknownOrder::to_be_found);

  std::size_t size() const { return inverse_diagonal_.size(); }
  // Where the elimination order puts each unknown: position()[i] is the row of unknown i in
  // solve().
  const std::vector<std::uint32_t>& position() const { return position_; }
  // rows: size() × 4 right sides in elimination order, replaced by the solution. One solve at a
  // time.
  void solve(PaddedVector* rows) const;
  // The same for three right sides: the fourth lane has to be 0, and stays.
  void solve_points(PaddedVector* rows) const;
  // And for two lots of three, in little more time than one takes.
  void solve_points(PaddedVector* first, PaddedVector* second) const;

 private:
  struct Panel {
    std::uint32_t first = 0, width = 0;  // columns first … first+width−1
    std::uint32_t blocks = 0;            // of rows under the diagonal block
    std::size_t rows_at = 0;             // of their indices, in row_index_
    std::size_t values_at = 0;           // as PanelView has them
  };
  PanelView view(const Panel& panel) const;
  template <int kLots, int kLanes>
  void solve_lots(const std::array<PaddedVector*, kLots>& lots) const;
  void add_panel(const FactorPanel& panel);

  std::vector<std::uint32_t> position_;
  std::vector<double> scale_;  // 1/√a_ii: the factor is that of the matrix with a unit diagonal
  std::vector<float> inverse_diagonal_;
  std::vector<Panel> panels_;
  std::vector<std::uint32_t> row_index_;
  std::vector<float> values_;
  mutable std::vector<float> rows_, planes_;  // of the solve that runs
};

}  // namespace organbake::deform
