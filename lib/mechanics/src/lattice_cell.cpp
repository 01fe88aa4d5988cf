// SPDX-License-Identifier: GPL-3.0-or-later
// The five tetrahedra of a cube, told by the parity of its corners; mirror images in neighbouring
// cubes, so that their faces match.
#include "lattice_cell.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace organbake {
namespace {

constexpr int kOpposite = 7;  // corner ^ 7 lies across the cube, corner ^ 1, 2, 4 along an axis

double distance_along(const Eigen::Vector3d& at, int corner, int axis) {
  return std::abs(at[axis] - (corner >> axis & 1));
}

bool is_odd(int corner) { return ((corner ^ corner >> 1 ^ corner >> 2) & 1) != 0; }

}  // namespace

// Of the middle tetrahedron: the corners that lie an even (odd) number of edges from corner 0.
int LatticeCell::middle_corner(int k) const {
  constexpr std::array<int, 4> kEven = {0, 3, 5, 6}, kOdd = {7, 4, 2, 1};
  return odd ? kOdd[k] : kEven[k];
}

std::array<int, 4> LatticeCell::corners(int tetrahedron) const {
  std::array<int, 4> result;
  bool positive = odd;
  if (tetrahedron == 0) {
    for (int k = 0; k < 4; ++k) result[k] = middle_corner(k);
  } else {
    const int own = middle_corner(tetrahedron - 1) ^ kOpposite;
    result = {own, own ^ 1, own ^ 2, own ^ 4};
    positive = !is_odd(own);  // x, y, z from corner 0 are right-handed, each flip mirrors
  }
  if (!positive) std::swap(result[2], result[3]);
  return result;
}

// The corner tetrahedron at c holds what is nearer to c than 1 by the sum of coordinates; the
// middle one's weight of a corner grows from 0 to 1 as that sum from the opposite corner does from
// 1 to 3.
LatticeCell::Location LatticeCell::locate(const Eigen::Vector3d& at) const {
  Location location;
  std::array<double, 8> weight{};
  for (int k = 0; k < 4; ++k) {
    const int own = middle_corner(k) ^ kOpposite;
    double sum = 0;
    for (int axis = 0; axis < 3; ++axis) sum += distance_along(at, own, axis);
    if (sum < 1) {
      location.tetrahedron = k + 1;
      weight.fill(0);
      for (int axis = 0; axis < 3; ++axis) {
        weight[own ^ 1 << axis] = distance_along(at, own, axis);
      }
      weight[own] = 1 - sum;
      break;
    }
    weight[middle_corner(k)] = (sum - 1) / 2;
  }
  const auto own = corners(location.tetrahedron);
  for (int k = 0; k < 4; ++k) location.weights[k] = std::clamp(weight[own[k]], 0.0, 1.0);
  return location;
}

}  // namespace organbake
