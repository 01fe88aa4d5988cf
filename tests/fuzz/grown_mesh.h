// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// Meshes out of any bytes.

#include <Eigen/Core>
#include <cstddef>
#include <span>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// Reads any bytes as what is wanted next, so that every input means something and a small change of
// it a small change of that. After the last byte there are zeros. Draw one thing
// in a statement: of two arguments compilers draw now the one first, now the other.
class Drawn {
 public:
  explicit Drawn(std::span<const std::byte> bytes) : bytes_(bytes) {}

  bool any_left() const { return !bytes_.empty(); }
  std::size_t below(std::size_t count);     // 0 … count − 1; count ≤ 2¹⁶
  double between(double low, double high);  // low at first
  double power_of_ten(double low, double high);
  double odd_number();                  // none, none finite, or at the ends of what there is
  Eigen::Vector3d vector(double most);  // each part −most … most

 private:
  unsigned byte();
  unsigned pair();

  std::span<const std::byte> bytes_;
};

// A small solid (4…320 faces, some 10 mm) that stays closed and outward, pushed and bent.
TriangleMesh sound_mesh(Drawn& drawn);

// The same after up to seven changes: most leave a closed mesh closed, others tear it, double or
// turn faces, weld vertices, put bodies side by side, or put in bad numbers and indices.
TriangleMesh grown_mesh(Drawn& drawn);

}  // namespace organbake
