// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "contact/padded_vector.h"

namespace organbake::deform {

// Four 3×3 matrices side by side: entry (row i, column j) of each in [3 i + j].
struct Matrices {
  Double4 entries[9] = {};
  Double4& operator[](int entry) { return entries[entry]; }
  const Double4& operator[](int entry) const { return entries[entry]; }
};

// The rotations nearest to four matrices (Frobenius): the polar factor, by Newton's iteration with
// Higham's scaling (1986). A matrix that is inside out or flat has its nearest rotation from a
// singular value decomposition instead, the smallest value's sign turned (Irving et al. 2004), so
// that an inverted element is led back the shortest way. Not finite in, anything finite out.
void nearest_rotations(const Matrices& f, Matrices& rotation);

}  // namespace organbake::deform
