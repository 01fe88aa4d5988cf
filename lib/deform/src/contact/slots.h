// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace organbake::deform {

inline constexpr std::uint32_t kAnchored = 0xFFFFFFFFu;

// Numbers the points that are no anchors from 0 on; anchors get kAnchored.
std::vector<std::uint32_t> number_free(std::size_t points,
                                       const std::vector<std::uint32_t>& anchors);
// The same, in an order that has each of them once.
std::vector<std::uint32_t> number_free_in_order(std::size_t points,
                                                const std::vector<std::uint32_t>& order);
std::size_t count_free(const std::vector<std::uint32_t>& free_of_point);

}  // namespace organbake::deform
