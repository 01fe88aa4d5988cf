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
  // Four numbers a texel, floats or words; what is not a whole row is padded in `numbers`.
  template <class Number>
  void fill(std::vector<Number>& numbers) {
    static_assert(sizeof(Number) == 4);
    numbers.resize(whole_rows(numbers.size()));
    upload(numbers.data(), numbers.size());
  }
  unsigned texture() const { return texture_.name(); }
  std::size_t bytes() const { return std::size_t{16} * kColumns * rows_; }

 private:
  static std::size_t whole_rows(std::size_t numbers);
  void upload(const void* numbers, std::size_t count);

  Texel texel_;
  TextureName texture_;
  int rows_ = 0;
};

}  // namespace organbake
