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
using Row = Eigen::Vector4d;
using Rows = std::vector<Row>;

inline Row to_row(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z(), 0}; }

// The same four doubles as the compiler's own vector type, for the hot loops: g++ 12 copies an
// Eigen vector through two half registers and stalls on the store, which doubled the time of a
// solve.
using Lanes [[gnu::vector_size(32), gnu::may_alias]] = double;
inline Lanes* as_lanes(Row* rows) { return reinterpret_cast<Lanes*>(rows); }
inline const Lanes* as_lanes(const Row* rows) { return reinterpret_cast<const Lanes*>(rows); }
inline double dot(const Lanes& a, const Lanes& b) {
  const Lanes p = a * b;
  return (p[0] + p[1]) + p[2];
}
inline Lanes cross(const Lanes& a, const Lanes& b) {
  const Lanes a_yzx = __builtin_shufflevector(a, a, 1, 2, 0, 3);
  const Lanes b_yzx = __builtin_shufflevector(b, b, 1, 2, 0, 3);
  const Lanes c_zxy = a * b_yzx - a_yzx * b;
  return __builtin_shufflevector(c_zxy, c_zxy, 1, 2, 0, 3);
}

}  // namespace organbake::deform
