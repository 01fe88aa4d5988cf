// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

namespace organbake::deform {

// One point or vector as a full AVX register: x, y, z and a fourth lane that is kept 0, so that
// norms and dot products need no mask. The factor also uses the four lanes as four right sides.
// What holds one is aligned to 32 bytes. g++ 12's std::stable_sort moves it through memory that is
// not (its bug 105258): such things are sorted by std::sort, with a rank that has no ties.
using PaddedVector = Eigen::Vector4d;
using PaddedVectors = std::vector<PaddedVector>;

inline PaddedVector padded(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z(), 0}; }

// The same four doubles as the compiler's own vector type, for the hot loops: g++ 12 copies an
// Eigen vector through two half registers and stalls on the store, which doubled the time of a
// solve.
using Double4 [[gnu::vector_size(32), gnu::may_alias]] = double;
inline Double4* as_double4(PaddedVector* rows) { return reinterpret_cast<Double4*>(rows); }
inline const Double4* as_double4(const PaddedVector* rows) {
  return reinterpret_cast<const Double4*>(rows);
}
inline double dot(const Double4& a, const Double4& b) {
  const Double4 p = a * b;
  return (p[0] + p[1]) + p[2];
}
inline Double4 cross(const Double4& a, const Double4& b) {
  const Double4 a_yzx = __builtin_shufflevector(a, a, 1, 2, 0, 3);
  const Double4 b_yzx = __builtin_shufflevector(b, b, 1, 2, 0, 3);
  const Double4 c_zxy = a * b_yzx - a_yzx * b;
  return __builtin_shufflevector(c_zxy, c_zxy, 1, 2, 0, 3);
}

}  // namespace organbake::deform
