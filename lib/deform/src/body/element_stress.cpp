// SPDX-License-Identifier: Apache-2.0
// Stress and energy of linear corotational elements, four side by side (Müller and Gross 2004; the
// energy as Chao et al. 2010 have it), from their deformation gradients; and the rotation nearest
// to each, by Newton's iteration for the polar decomposition (Higham 1986).
#include "body/tissue.h"

#include <Eigen/Dense>

namespace organbake::deform {
namespace {

constexpr int kMostRounds = 20;      // well-shaped tissue takes five
constexpr int kScaledRounds = 3;     // beyond, Newton converges quadratically by itself
constexpr double kChange = 1e-16;    // squared; the next round's is about its square
constexpr double kFlatShare = 1e-4;  // det / |F|³ below which Newton's inverse loses digits

Double4 squared_norm(const Matrices& m) {
  Double4 sum{};
  for (const Double4& entry : m.entries) sum += entry * entry;
  return sum;
}

void cofactors(const Matrices& m, Matrices& c) {
  for (int i = 0; i < 3; ++i) {
    const int p = 3 * ((i + 1) % 3), q = 3 * ((i + 2) % 3);
    for (int j = 0; j < 3; ++j) {
      const int r = (j + 1) % 3, s = (j + 2) % 3;
      c[3 * i + j] = m[p + r] * m[q + s] - m[p + s] * m[q + r];
    }
  }
}

Double4 determinant(const Matrices& m, const Matrices& cofactor) {
  return m[0] * cofactor[0] + m[1] * cofactor[1] + m[2] * cofactor[2];
}

void set_lane(Matrices& m, int lane, const Eigen::Matrix3d& value) {
  for (int e = 0; e < 9; ++e) m[e][lane] = value(e / 3, e % 3);
}

Eigen::Matrix3d rotation_by_svd(const Matrices& f, int lane) {
  Eigen::Matrix3d m;
  for (int e = 0; e < 9; ++e) m(e / 3, e % 3) = f[e][lane];
  if (!m.allFinite()) return Eigen::Matrix3d::Identity();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU();
  const Eigen::Matrix3d& v = svd.matrixV();
  if ((u * v.transpose()).determinant() < 0) u.col(2) = -u.col(2);
  return u * v.transpose();
}

// One round: X ← (γX + X⁻ᵀ/γ)/2. Returns the squared change, summed over the four.
double newton_round(Matrices& x, const Matrices& cofactor, const Double4& det, bool scaled) {
  Double4 gamma = Double4{} + 1;
  if (scaled)
    gamma = square_roots(square_roots(squared_norm(cofactor) / (det * det * squared_norm(x))));
  const Double4 own = 0.5 * gamma, inverse = 0.5 / (gamma * det);
  Double4 change{};
  for (int e = 0; e < 9; ++e) {
    const Double4 next = own * x[e] + inverse * cofactor[e];
    change += (next - x[e]) * (next - x[e]);
    x[e] = next;
  }
  return change[0] + change[1] + change[2] + change[3];
}

}  // namespace

void nearest_rotations(const Matrices& f, Matrices& rotation) {
  rotation = f;
  Matrices cofactor;
  cofactors(rotation, cofactor);
  Double4 det = determinant(rotation, cofactor);
  const Double4 size = square_roots(squared_norm(f));
  std::array<bool, 4> flat{};
  for (int lane = 0; lane < 4; ++lane) {
    flat[lane] = !(det[lane] > kFlatShare * size[lane] * size[lane] * size[lane]);
    if (!flat[lane]) continue;
    set_lane(rotation, lane, Eigen::Matrix3d::Identity());  // a stand-in, overwritten below
    set_lane(cofactor, lane, Eigen::Matrix3d::Identity());
    det[lane] = 1;
  }
  for (int round = 0; round < kMostRounds; ++round) {
    if (round > 0) {
      cofactors(rotation, cofactor);
      det = determinant(rotation, cofactor);
    }
    if (newton_round(rotation, cofactor, det, round < kScaledRounds) < kChange) break;
  }
  for (int lane = 0; lane < 4; ++lane) {
    if (flat[lane]) set_lane(rotation, lane, rotation_by_svd(f, lane));
  }
}

namespace {

// The nearest values of sum 3 and at least `least` to descending ones: a projection onto a simplex.
Eigen::Vector3d nearest_of_sum_3(const Eigen::Vector3d& s, double least) {
  Eigen::Vector3d result = Eigen::Vector3d::Constant(least);
  double taken = 3;
  for (int kept = 3; kept >= 1; --kept) {
    // All but the `kept` largest lie at the bound; those share what is left.
    const double shift = (taken - s.head(kept).sum()) / kept;
    if (kept == 1 || s[kept - 1] + shift >= least) {
      for (int i = 0; i < kept; ++i) result[i] = s[i] + shift;
      break;
    }
    taken -= least;
  }
  return result;
}

}  // namespace

ElementStress::ElementStress(const Matrices& f) : f_(f) {
  nearest_rotations(f, rotation_);
  keep_volume();
}

void ElementStress::keep_volume() {
  Double4 trace = Double4{} - 3;
  for (int e = 0; e < 9; ++e) trace += rotation_[e] * f_[e];
  for (int e = 0; e < 9; ++e) from_kept_[e] = trace * rotation_[e];
  // The bound bites where S − (tr/3 − 1 + least) 1 is not positive, S = RᵀF: by its leading minors.
  const Double4 shift = trace / 3 + kLeastStretch;
  Double4 s[6];  // xx, yy, zz, xy, xz, yz
  constexpr int kRow[6] = {0, 1, 2, 0, 0, 1}, kColumn[6] = {0, 1, 2, 1, 2, 2};
  for (int i = 0; i < 6; ++i) {
    s[i] = rotation_[kRow[i]] * f_[kColumn[i]] + rotation_[3 + kRow[i]] * f_[3 + kColumn[i]] +
           rotation_[6 + kRow[i]] * f_[6 + kColumn[i]];
    if (i < 3) s[i] -= shift;
  }
  const Double4 second = s[0] * s[1] - s[3] * s[3];
  const Double4 third =
      s[2] * second - s[0] * s[5] * s[5] - s[1] * s[4] * s[4] + 2 * s[3] * s[4] * s[5];
  for (int lane = 0; lane < 4; ++lane) {
    if (!(s[0][lane] > 0 && second[lane] > 0 && third[lane] > 0)) keep_volume_of_lane(lane);
  }
}

void ElementStress::keep_volume_of_lane(int lane) {
  Eigen::Matrix3d f;
  for (int e = 0; e < 9; ++e) f(e / 3, e % 3) = f_[e][lane];
  if (!f.allFinite()) return;  // the state is lost, and noticed
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(f, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU();
  Eigen::Vector3d s = svd.singularValues();
  if ((u * svd.matrixV().transpose()).determinant() < 0) {
    u.col(2) = -u.col(2);
    s[2] = -s[2];
  }
  const Eigen::Vector3d away = 3 * (s - nearest_of_sum_3(s, kLeastStretch));
  const Eigen::Matrix3d from_kept = u * away.asDiagonal() * svd.matrixV().transpose();
  for (int e = 0; e < 9; ++e) from_kept_[e][lane] = from_kept(e / 3, e % 3);
}

void ElementStress::stress(const Double4& shear, const Double4& bulk, Matrices& stress) const {
  for (int e = 0; e < 9; ++e) {
    stress[e] = shear * (f_[e] - rotation_[e]) + bulk * from_kept_[e];
  }
}

void ElementStress::add_viscous(const Double4& viscosity, const Matrices& f_start,
                                Matrices& stress) const {
  Matrices change, turned;
  for (int e = 0; e < 9; ++e) change[e] = f_[e] - f_start[e];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      turned[3 * i + j] = rotation_[i] * change[j] + rotation_[3 + i] * change[3 + j] +
                          rotation_[6 + i] * change[6 + j];
  const Double4 half = viscosity / 2;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k)
        stress[3 * i + j] += half * rotation_[3 * i + k] * (turned[3 * k + j] + turned[3 * j + k]);
}

Double4 ElementStress::energy(const Double4& shear, const Double4& bulk) const {
  Double4 turned{}, swollen{};
  for (int e = 0; e < 9; ++e) {
    turned += (f_[e] - rotation_[e]) * (f_[e] - rotation_[e]);
    swollen += from_kept_[e] * from_kept_[e];
  }
  return (shear * turned + bulk * swollen / 3) / 2;
}

}  // namespace organbake::deform
