// SPDX-License-Identifier: Apache-2.0
// Writes and reads base64 (RFC 4648).
#include "organbake/core/text.h"

#include <algorithm>
#include <cstdint>

namespace organbake {
namespace {

// −1 for what is no letter of base64.
int base64_digit(char c) {
  if (c >= 'A' && c <= 'Z') return c - 'A';
  if (c >= 'a' && c <= 'z') return c - 'a' + 26;
  if (c >= '0' && c <= '9') return c - '0' + 52;
  return c == '+' ? 62 : c == '/' ? 63 : -1;
}

}  // namespace

std::string to_base64(std::span<const std::byte> bytes) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t three = 0;
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    for (std::size_t k = 0; k < 3; ++k)
      three = three << 8 | (k < count ? std::to_integer<std::uint32_t>(bytes[i + k]) : 0);
    for (std::size_t k = 0; k < 4; ++k)
      text += k <= count ? kDigits[three >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

bool take_base64_group(std::string_view& text, std::string& bytes) {
  constexpr std::string_view kSpace = " \t\r\n";
  std::uint32_t bits = 0;
  int letters = 0, fill = 0;
  for (; letters < 4 && !text.empty(); text.remove_prefix(1)) {
    const char c = text.front();
    if (kSpace.find(c) != kSpace.npos) continue;
    const int digit = base64_digit(c);
    if (digit < 0 && c != '=') return false;
    fill += c == '=';
    bits = bits << 6 | static_cast<std::uint32_t>(std::max(digit, 0));
    ++letters;
  }
  if (letters < 4 || fill > 2) return false;
  for (int i = 0; i < 3 - fill; ++i) bytes += static_cast<char>(bits >> (16 - 8 * i) & 0xFF);
  return true;
}

}  // namespace organbake
