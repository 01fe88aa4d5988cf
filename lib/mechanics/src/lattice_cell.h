// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>

namespace organbake {

// A cube cut into five tetrahedra: one in the middle on every other corner, and one at each corner
// between. Neighbouring cells are cut as mirror images (`odd`), so that their faces match. Corners
// are numbered by bits: 1 for x, 2 for y, 4 for z.
struct LatticeCell {
  static constexpr int kTetrahedra = 5;

  bool odd = false;

  // Corners of tetrahedron 0 (the middle) … 4, of positive volume.
  std::array<int, 4> corners(int tetrahedron) const;
  struct Location {
    int tetrahedron = 0;
    std::array<double, 4> weights{};  // of its corners, 0…1 and of sum 1
  };
  // Where a point of the unit cube lies.
  Location locate(const Eigen::Vector3d& at) const;

 private:
  int middle_corner(int k) const;
};

}  // namespace organbake
