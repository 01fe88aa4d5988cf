// SPDX-License-Identifier: GPL-3.0-or-later
#include "fuzz/drawn.h"

#include <cmath>
#include <iterator>
#include <limits>

namespace organbake {

unsigned Drawn::byte() {
  if (bytes_.empty()) return 0;
  const auto value = std::to_integer<unsigned>(bytes_.front());
  bytes_ = bytes_.subspan(1);
  return value;
}

unsigned Drawn::pair() {
  const unsigned low = byte();
  return low | byte() << 8;
}

std::size_t Drawn::below(std::size_t count) { return (count <= 256 ? byte() : pair()) % count; }

double Drawn::between(double low, double high) { return low + (high - low) * pair() / 65535.0; }

double Drawn::power_of_ten(double low, double high) { return std::pow(10.0, between(low, high)); }

double Drawn::odd_number() {
  using Limits = std::numeric_limits<double>;
  constexpr double kNumbers[] = {0,      Limits::quiet_NaN(),  Limits::infinity(), -1,    1e300,
                                 1e-300, Limits::denorm_min(), Limits::max(),      -1e300};
  return kNumbers[below(std::size(kNumbers))];
}

Eigen::Vector3d Drawn::vector(double most) {
  const double x = between(-most, most), y = between(-most, most);
  return {x, y, between(-most, most)};
}

}  // namespace organbake
