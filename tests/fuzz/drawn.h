// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>

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

}  // namespace organbake
