// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "gl_names.h"

namespace organbake {

inline constexpr double kColorRoot = 2;  // the largest root of a colour that a table holds

// A table that shaders read by texelFetch(…, table_at(i), 0): a texture of kColumns texels a row.
// Its memory stays from one filling to the next.
class Table {
 public:
  static constexpr int kBits = 11, kColumns = 1 << kBits;
  enum class Texel : std::uint8_t { floats, words };  // four of 32 bits each

  explicit Table(Texel texel) : texel_(texel) {}
  // Room for so many texels. Where there was less, what was in it is lost.
  void reserve(std::size_t texels);
  // Four numbers a texel, floats or words, into the room from a texel on.
  template <class Number>
  void put(std::size_t first, const std::vector<Number>& numbers) {
    static_assert(sizeof(Number) == 4);
    upload(first, numbers.data(), numbers.size() / 4);
  }
  template <class Number>
  void fill(const std::vector<Number>& numbers) {
    reserve(numbers.size() / 4);
    put(0, numbers);
  }
  unsigned texture() const { return texture_.name(); }
  std::size_t bytes() const { return std::size_t{16} * kColumns * rows_; }

 private:
  void upload(std::size_t first, const void* numbers, std::size_t texels);

  Texel texel_;
  TextureName texture_;
  std::size_t rows_ = 0;
};

}  // namespace organbake
