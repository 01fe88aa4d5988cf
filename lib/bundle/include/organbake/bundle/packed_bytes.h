// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "organbake/core/error.h"

namespace organbake {

static_assert(std::endian::native == std::endian::little, "packed numbers are little-endian");

// Numbers one after the other, little-endian.
class PackedWriter {
 public:
  template <class Number>
  requires(std::is_arithmetic_v<Number> || std::is_enum_v<Number>) void add(Number number) {
    const auto* bytes = reinterpret_cast<const std::byte*>(&number);
    bytes_.insert(bytes_.end(), bytes, bytes + sizeof(Number));
  }
  void add(std::span<const std::byte> bytes) {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  }
  const std::vector<std::byte>& bytes() const { return bytes_; }
  std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  std::vector<std::byte> bytes_;
};

// Reads them back and trusts nothing: every count is held against what is left before memory is
// taken. Throws BadDataError, beginning with `name`.
class PackedReader {
 public:
  PackedReader(std::span<const std::byte> bytes, const std::string& name)
      : rest_(bytes), name_(name) {}

  template <class Number>
  Number next() {
    Number number;
    std::memcpy(&number, take(sizeof(Number)).data(), sizeof(Number));
    return number;
  }
  std::span<const std::byte> take(std::size_t count) {
    if (count > rest_.size())
      fail("ends early: " + std::to_string(count) + " bytes are wanted, " +
           std::to_string(rest_.size()) + " are left");
    const auto taken = rest_.first(count);
    rest_ = rest_.subspan(count);
    return taken;
  }
  void end() const {
    if (!rest_.empty()) fail("has " + std::to_string(rest_.size()) + " bytes too many");
  }
  [[noreturn]] void fail(const std::string& message) const {
    throw BadDataError(name_ + ": " + message);
  }

 private:
  std::span<const std::byte> rest_;
  std::string name_;
};

}  // namespace organbake
