// SPDX-License-Identifier: Apache-2.0
// Writes and reads base64 (RFC 4648), and finds the name that was probably meant by a mistyped one:
// the candidate of the least Levenshtein distance, or one that differs by a unit at its end.
#include "organbake/core/text.h"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <numeric>

namespace organbake {
namespace {

constexpr std::string_view kDigits =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

// Names are told apart neither by case nor by what joins their words.
char plain(char c) {
  if (c == '-' || c == ' ') return '_';
  return static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
}

// Levenshtein's distance, one row at a time.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (plain(a[i]) == plain(b[j]) ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, diagonal + 1});
    }
  }
  return row[b.size()];
}

// Whether the candidate is the name and a unit: size_px of size.
bool lacks_unit(std::string_view name, std::string_view candidate) {
  return !name.empty() && candidate.size() > name.size() && plain(candidate[name.size()]) == '_' &&
         edit_distance(name, candidate.substr(0, name.size())) == 0;
}

}  // namespace

std::string to_base64(std::span<const std::byte> bytes) {
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
    const std::size_t digit = c == '=' ? 0 : kDigits.find(c);
    if (digit == kDigits.npos) return false;
    fill += c == '=';
    bits = bits << 6 | static_cast<std::uint32_t>(digit);
    ++letters;
  }
  if (letters < 4 || fill > 2) return false;
  for (int i = 0; i < 3 - fill; ++i) bytes += static_cast<char>(bits >> (16 - 8 * i) & 0xFF);
  return true;
}

std::string suggestion(std::string_view name, const std::vector<std::string>& candidates) {
  const std::string* nearest = nullptr;
  std::size_t least = std::max<std::size_t>(2, name.size() / 3) + 1;
  for (const std::string& candidate : candidates) {
    const std::size_t distance = lacks_unit(name, candidate) ? 0 : edit_distance(name, candidate);
    if (distance < least && distance < candidate.size()) {
      least = distance;
      nearest = &candidate;
    }
  }
  return nearest ? "; did you mean '" + *nearest + "'?" : std::string();
}

}  // namespace organbake
