// SPDX-License-Identifier: Apache-2.0
#include "solver/nearest_rotation.h"

#include <Eigen/Dense>
#include <array>

#include "contact/angles.h"

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
    set_lane(rotation, lane, Eigen::Matrix3d::Identity());  // goes along for nothing
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

}  // namespace organbake::deform
