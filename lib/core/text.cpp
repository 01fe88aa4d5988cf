// SPDX-License-Identifier: Apache-2.0
#include "core/text.h"

#include <array>
#include <charconv>

namespace organbake {
namespace {

// std::to_chars is locale-free; the buffer holds any double in either form we ask for.
template <typename... Format>
std::string written(double value, Format... format) {
  std::array<char, 400> buffer;
  const auto result = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, format...);
  return {buffer.data(), result.ptr};
}

}  // namespace

std::string to_text(double value) { return written(value); }

std::string to_text(double value, int digits_after_point) {
  return written(value, std::chars_format::fixed, digits_after_point);
}

}  // namespace organbake
