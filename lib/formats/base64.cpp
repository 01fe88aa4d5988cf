// SPDX-License-Identifier: GPL-3.0-or-later
#include "formats/base64.h"

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
