// SPDX-License-Identifier: Apache-2.0
// Reads PLY files (Turk 1994) word by word or byte by byte. Counts in the header are checked
// against the length of the file before anything is made that large.
#include "ply_scanner.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <limits>
#include <map>

#include "organbake/core/error.h"
#include "organbake/core/text.h"

namespace organbake {
namespace {

constexpr std::string_view kPlyComment = " millimetres, LPS";  // write_ply's

const std::map<std::string_view, ScalarType> kTypes = {
    {"char", ScalarType::int8},      {"int8", ScalarType::int8},
    {"uchar", ScalarType::uint8},    {"uint8", ScalarType::uint8},
    {"short", ScalarType::int16},    {"int16", ScalarType::int16},
    {"ushort", ScalarType::uint16},  {"uint16", ScalarType::uint16},
    {"int", ScalarType::int32},      {"int32", ScalarType::int32},
    {"uint", ScalarType::uint32},    {"uint32", ScalarType::uint32},
    {"float", ScalarType::float32},  {"float32", ScalarType::float32},
    {"double", ScalarType::float64}, {"float64", ScalarType::float64}};

std::string_view next_word(std::string_view& rest) {
  const std::size_t begin = rest.find_first_not_of(" \t");
  if (begin == std::string_view::npos) return rest = {};
  const std::size_t end = std::min(rest.find_first_of(" \t", begin), rest.size());
  const std::string_view result = rest.substr(begin, end - begin);
  rest.remove_prefix(end);
  return result;
}

}  // namespace

PlyScanner::PlyScanner(std::span<const std::byte> bytes, std::string name)
    : text_(reinterpret_cast<const char*>(bytes.data()), bytes.size()), name_(std::move(name)) {
  parse_header();
}

void PlyScanner::fail(const std::string& message) const {
  throw BadDataError(name_ + ": " + message);
}

std::string_view PlyScanner::line() {
  const std::size_t end = text_.find('\n', position_);
  if (end == std::string_view::npos) fail("the PLY header does not end");
  std::string_view result = text_.substr(position_, end - position_);
  position_ = end + 1;
  if (result.ends_with('\r')) result.remove_suffix(1);
  return result;
}

ScalarType PlyScanner::scalar_type(std::string_view type) const {
  const auto found = kTypes.find(type);
  if (found == kTypes.end()) fail("unknown PLY type '" + std::string(type) + "'");
  return found->second;
}

void PlyScanner::parse_header() {
  if (line() != "ply") fail("is not a PLY file");
  for (;;) {
    std::string_view rest = line();
    const std::string_view key = next_word(rest);
    if (key == "end_header") break;
    if (key == "format") {
      const std::string_view format = next_word(rest);
      ascii_ = format == "ascii";
      swaps_ = format == "binary_big_endian";
      if (!ascii_ && !swaps_ && format != "binary_little_endian") {
        fail("PLY format '" + std::string(format) + "' is not known");
      }
    } else if (key == "comment") {
      is_ours_ = is_ours_ || rest == kPlyComment;
    } else if (key == "element") {
      add_element(rest);
    } else if (key == "property") {
      add_property(rest);
    }
  }
}

void PlyScanner::add_element(std::string_view rest) {
  PlyElement element;
  element.name = next_word(rest);
  const std::string_view count = next_word(rest);
  const auto result = std::from_chars(count.data(), count.data() + count.size(), element.count);
  if (result.ec != std::errc()) fail("element " + element.name + " has no count");
  // Every row takes at least a byte, so a count beyond the file's size is a lie.
  if (element.count > text_.size() || element.count > std::numeric_limits<std::uint32_t>::max()) {
    fail("claims " + std::to_string(element.count) + " of " + element.name + " in " +
         std::to_string(text_.size()) + " bytes");
  }
  elements_.push_back(std::move(element));
}

void PlyScanner::add_property(std::string_view rest) {
  if (elements_.empty()) fail("a property stands before any element");
  PlyProperty property;
  std::string_view type = next_word(rest);
  if (type == "list") {
    property.list_count = scalar_type(next_word(rest));
    type = next_word(rest);
  }
  property.type = scalar_type(type);
  property.name = next_word(rest);
  elements_.back().properties.push_back(std::move(property));
}

template <typename T>
double PlyScanner::binary() {
  if (text_.size() - position_ < sizeof(T))
    fail("ends early, at byte " + std::to_string(text_.size()));
  T value;
  std::array<char, sizeof(T)> raw;
  std::memcpy(raw.data(), text_.data() + position_, sizeof(T));
  if (swaps_) std::reverse(raw.begin(), raw.end());
  std::memcpy(&value, raw.data(), sizeof(T));
  position_ += sizeof(T);
  return static_cast<double>(value);
}

double PlyScanner::ascii_number() {
  position_ = std::min(text_.find_first_not_of(" \t\r\n", position_), text_.size());
  double value = 0;
  const std::size_t length = read_number(text_.substr(position_), value);
  if (length == 0) fail("has no number at byte " + std::to_string(position_));
  position_ += length;
  return value;
}

double PlyScanner::number(ScalarType type) {
  if (ascii_) return ascii_number();
  return with_scalar_type(type, [&](auto zero) { return binary<decltype(zero)>(); });
}

std::size_t PlyScanner::list_length(const PlyProperty& property) {
  const double count = number(*property.list_count);
  if (!(count >= 0 && count <= static_cast<double>(text_.size() - position_))) {
    fail("claims a list of " + std::to_string(count) + " entries");
  }
  return static_cast<std::size_t>(count);
}

void PlyScanner::skip_row(const PlyElement& element) {
  for (const PlyProperty& property : element.properties) {
    const std::size_t count = count_of(property);
    for (std::size_t i = 0; i < count; ++i) number(property.type);
  }
}

}  // namespace organbake
