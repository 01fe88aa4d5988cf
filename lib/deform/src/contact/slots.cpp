// SPDX-License-Identifier: Apache-2.0
#include "contact/slots.h"

#include <algorithm>

namespace organbake::deform {

std::vector<std::uint32_t> number_free(std::size_t points,
                                       const std::vector<std::uint32_t>& anchors) {
  std::vector<std::uint32_t> free_of_point(points, 0);
  for (const std::uint32_t anchor : anchors) free_of_point[anchor] = kAnchored;
  std::uint32_t next = 0;
  for (auto& index : free_of_point) {
    if (index != kAnchored) index = next++;
  }
  return free_of_point;
}

std::vector<std::uint32_t> number_free_in_order(std::size_t points,
                                                const std::vector<std::uint32_t>& order) {
  std::vector<std::uint32_t> free_of_point(points, kAnchored);
  std::uint32_t next = 0;
  for (const std::uint32_t point : order) free_of_point[point] = next++;
  return free_of_point;
}

std::size_t count_free(const std::vector<std::uint32_t>& free_of_point) {
  return free_of_point.size() - std::count(free_of_point.begin(), free_of_point.end(), kAnchored);
}

}  // namespace organbake::deform
