// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace organbake {

// The kinds of numbers that files of meshes and volumes store. A reader maps the names or codes of
// its own format to these; how wide they are and which C++ type holds them stands here alone.
enum class ScalarType {
  int8,
  uint8,
  int16,
  uint16,
  int32,
  uint32,
  int64,
  uint64,
  float32,
  float64
};

// Calls use(zero) with a zero of the C++ type and returns what it returns.
template <typename Use>
decltype(auto) with_scalar_type(ScalarType type, Use&& use) {
  switch (type) {
    case ScalarType::int8:
      return use(std::int8_t{});
    case ScalarType::uint8:
      return use(std::uint8_t{});
    case ScalarType::int16:
      return use(std::int16_t{});
    case ScalarType::uint16:
      return use(std::uint16_t{});
    case ScalarType::int32:
      return use(std::int32_t{});
    case ScalarType::uint32:
      return use(std::uint32_t{});
    case ScalarType::int64:
      return use(std::int64_t{});
    case ScalarType::uint64:
      return use(std::uint64_t{});
    case ScalarType::float32:
      return use(float{});
    case ScalarType::float64:
      break;
  }
  return use(double{});
}

inline std::size_t bytes_of(ScalarType type) {
  return with_scalar_type(type, [](auto zero) { return sizeof zero; });
}

inline bool is_floating_point(ScalarType type) {
  return with_scalar_type(type, [](auto zero) { return std::is_floating_point_v<decltype(zero)>; });
}

// Turns round the bytes of each of `count` numbers of that type: big-endian ↔ little-endian.
inline void swap_bytes(std::byte* numbers, std::size_t count, ScalarType type) {
  with_scalar_type(type, [&](auto zero) {
    for (std::size_t i = 0; i < count; ++i)
      std::reverse(numbers + i * sizeof zero, numbers + (i + 1) * sizeof zero);
  });
}

}  // namespace organbake
