// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <type_traits>
#include <utility>
#include <variant>

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
  // In the order of the list above.
  using Zero = std::variant<std::int8_t, std::uint8_t, std::int16_t, std::uint16_t, std::int32_t,
                            std::uint32_t, std::int64_t, std::uint64_t, float, double>;
  static const Zero kZeros[] = {std::int8_t{},  std::uint8_t{},  std::int16_t{}, std::uint16_t{},
                                std::int32_t{}, std::uint32_t{}, std::int64_t{}, std::uint64_t{},
                                float{},        double{}};
  return std::visit(std::forward<Use>(use), kZeros[static_cast<std::size_t>(type)]);
}

inline std::size_t bytes_of(ScalarType type) {
  return with_scalar_type(type, [](auto zero) { return sizeof zero; });
}

inline bool is_floating_point(ScalarType type) {
  return with_scalar_type(type, [](auto zero) { return std::is_floating_point_v<decltype(zero)>; });
}

// The number whose bytes begin there, in the machine's order or the other.
template <class Number>
Number bytes_as(const void* bytes, bool swapped = false) {
  std::byte raw[sizeof(Number)];
  std::memcpy(raw, bytes, sizeof raw);
  if (swapped) std::reverse(std::begin(raw), std::end(raw));
  Number number;
  std::memcpy(&number, raw, sizeof raw);
  return number;
}

// The whole number of up to four bytes from place `at` on.
template <class Bytes>
std::uint32_t whole_at(const Bytes& bytes, std::size_t at, std::size_t count, bool big_endian) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < count; ++i)
    value = value << 8 | static_cast<unsigned char>(bytes[at + (big_endian ? i : count - 1 - i)]);
  return value;
}

// Turns round the bytes of each of `count` numbers of that type: big-endian ↔ little-endian.
inline void swap_bytes(std::byte* numbers, std::size_t count, ScalarType type) {
  with_scalar_type(type, [&](auto zero) {
    for (std::size_t i = 0; i < count; ++i)
      std::reverse(numbers + i * sizeof zero, numbers + (i + 1) * sizeof zero);
  });
}

}  // namespace organbake
