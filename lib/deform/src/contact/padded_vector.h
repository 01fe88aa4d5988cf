// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
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

// How far the farthest of some points lies from its place in the other list; NaN stays.
inline double largest_distance(const PaddedVectors& a, const PaddedVectors& b) {
  const Double4* p = as_double4(a.data());
  const Double4* q = as_double4(b.data());
  double squared = 0;
  for (std::size_t i = 0; i < a.size() && squared >= 0; ++i) {
    const Double4 d = p[i] - q[i];
    if (!(dot(d, d) <= squared)) squared = dot(d, d);
  }
  return std::sqrt(squared);
}

inline Double4 square_roots(const Double4& v) {
  using Array = Eigen::Array<double, 4, 1>;
  Double4 roots;
  *reinterpret_cast<Array*>(&roots) = reinterpret_cast<const Array*>(&v)->sqrt();
  return roots;
}

// Angles in 0…π, four at once, by their sines (none negative) and cosines, each pair times a
// number > 0 of its own (1e-150…1e150: it is squared); of 0 and 0 no number. Within 2·10⁻¹¹ of
// themselves, in a fifth of the time of libm's atan2.
inline Double4 angles_of(const Double4& sine, const Double4& cosine) {
  // atan(t)/t on 0…1 as a polynomial in t²: interpolated at the Chebyshev points.
  constexpr double kCoefficients[] = {
      0.9999999999887356,  -0.3333333295162058,  0.1999997833507059,  -0.1428522559330104,
      0.1110530663237817,  -0.09049178707593561, 0.07495261502248678, -0.0602219530088545,
      0.0436465852317969,  -0.02600600302237301, 0.01142764442976421, -0.003195431620742266,
      0.000419229233207611};
  constexpr int kDegree = 12;
  // The tangent of half the angle to the nearer of the directions 0 and π.
  const Double4 length = square_roots(sine * sine + cosine * cosine);
  const Double4 t = sine / (length + (cosine < 0 ? -cosine : cosine));
  const Double4 square = t * t;
  Double4 quotient = Double4{} + kCoefficients[kDegree];
  for (int i = kDegree; i-- > 0;) quotient = quotient * square + kCoefficients[i];
  const Double4 angle = 2 * t * quotient;
  return cosine < 0 ? std::numbers::pi - angle : angle;
}

// An angle of 0…π that is added and compared without trigonometry.
struct Angle {
  double cosine = -1, sine = 0;

  static Angle between(const PaddedVector& a, const PaddedVector& b) {  // unit vectors
    const double cosine = std::clamp(a.dot(b), -1.0, 1.0);
    return {cosine, std::sqrt(1 - cosine * cosine)};
  }
  bool acute() const { return cosine > 0; }
};

inline constexpr Angle kNoAngle{1, 0}, kHalfTurn{-1, 0};

// At most half a turn, as the sum of two obtuse ones is.
inline Angle operator+(const Angle& a, const Angle& b) {
  const Angle sum{a.cosine * b.cosine - a.sine * b.sine, a.sine * b.cosine + a.cosine * b.sine};
  return sum.sine < 0 || (a.cosine < 0 && b.cosine < 0) ? kHalfTurn : sum;
}

inline Angle wider(const Angle& a, const Angle& b) { return b.cosine < a.cosine ? b : a; }

}  // namespace organbake::deform
