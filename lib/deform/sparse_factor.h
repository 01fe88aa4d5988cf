// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "deform/rows.h"

namespace organbake::deform {

// One entry of a symmetric matrix, given once for (i, j) and (j, i); repeated entries add up.
struct Coefficient {
  std::uint32_t i = 0, j = 0;
  double value = 0;
};

// Sparse L D Lᵀ of a symmetric positive definite matrix, made once (fill-reducing order: AMD), and
// back-substitution on four right sides at a time. Columns of L with the same pattern are kept as
// dense panels (supernodes; Ng & Peyton 1993), so that the inner loops are plain dense products.
class SparseFactor {
 public:
  // Throws BadDataError when the matrix is not positive definite in double precision.
  SparseFactor(std::size_t size, const std::vector<Coefficient>& coefficients);

  std::size_t size() const { return inverse_diagonal_.size(); }
  // Where the elimination order puts each unknown: position()[i] is the row of unknown i in
  // solve().
  const std::vector<std::uint32_t>& position() const { return position_; }
  // rows: size() right sides in elimination order, replaced by the solution.
  void solve(Row* rows) const;

 private:
  struct Panel {
    std::uint32_t first = 0, width = 0;  // columns first … first+width−1
    std::uint32_t below = 0;             // rows under the diagonal block
    std::size_t rows_at = 0;             // of their indices, in row_index_
    std::size_t values_at = 0;           // width × width block, then below × width, row-major
  };
  void add_panel(std::uint32_t first, std::uint32_t last, const int* starts, const int* row_of,
                 const double* value_of);

  std::vector<std::uint32_t> position_;
  std::vector<double> inverse_diagonal_;
  std::vector<Panel> panels_;
  std::vector<std::uint32_t> row_index_;
  std::vector<double> values_;
};

}  // namespace organbake::deform
