// SPDX-License-Identifier: GPL-3.0-or-later
#include "vtk/legacy_vtk_scanner.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <map>

#include "organbake/core/error.h"
#include "organbake/core/scalar_type.h"

namespace organbake {
namespace {

constexpr std::string_view kSpace = " \t\r\n";

ScalarType type_of(const std::string& type, const LegacyVtkScanner& scanner) {
  static const std::map<std::string, ScalarType> kTypes = {{"unsigned_char", ScalarType::uint8},
                                                           {"char", ScalarType::int8},
                                                           {"signed_char", ScalarType::int8},
                                                           {"unsigned_short", ScalarType::uint16},
                                                           {"short", ScalarType::int16},
                                                           {"unsigned_int", ScalarType::uint32},
                                                           {"int", ScalarType::int32},
                                                           {"vtkidtype", ScalarType::int32},
                                                           {"vtkIdType", ScalarType::int32},
                                                           {"unsigned_long", ScalarType::uint64},
                                                           {"long", ScalarType::int64},
                                                           {"vtktypeint64", ScalarType::int64},
                                                           {"vtktypeuint64", ScalarType::uint64},
                                                           {"float", ScalarType::float32},
                                                           {"double", ScalarType::float64}};
  const auto found = kTypes.find(type);
  if (found == kTypes.end()) scanner.fail("values of type \"" + type + "\" are not read");
  return found->second;
}

template <typename Stored>
std::vector<double> decode(const char* bytes, std::size_t count) {
  std::vector<double> values(count);
  for (std::size_t i = 0; i < count; ++i) {
    std::array<char, sizeof(Stored)> raw;
    const char* last = bytes + (i + 1) * sizeof(Stored) - 1;
    for (std::size_t b = 0; b < sizeof(Stored); ++b) raw[b] = *(last - b);
    Stored value;
    std::memcpy(&value, raw.data(), sizeof(Stored));
    values[i] = static_cast<double>(value);
  }
  return values;
}

}  // namespace

LegacyVtkScanner::LegacyVtkScanner(std::span<const std::byte> bytes, std::string name)
    : text_(reinterpret_cast<const char*>(bytes.data()), bytes.size()), name_(std::move(name)) {
  if (text_.rfind("# vtk DataFile Version", 0) != 0) fail("is not a legacy VTK file");
  skip_line();
  skip_line();  // the title
  const std::string coding = word();
  if (coding != "ASCII" && coding != "BINARY") fail("is neither ASCII nor BINARY");
  binary_ = coding == "BINARY";
}

std::string LegacyVtkScanner::word() {
  const std::size_t first = text_.find_first_not_of(kSpace, at_);
  if (first == std::string_view::npos) {
    at_ = text_.size();
    return {};
  }
  at_ = std::min(text_.find_first_of(kSpace, first), text_.size());
  return std::string(text_.substr(first, at_ - first));
}

void LegacyVtkScanner::skip_line() {
  const std::size_t end = text_.find('\n', at_);
  at_ = end == std::string_view::npos ? text_.size() : end + 1;
}

void LegacyVtkScanner::skip_to_empty_line() {
  skip_line();  // the rest of this one
  while (at_ < text_.size()) {
    const std::size_t end = std::min(text_.find('\n', at_), text_.size());
    const bool empty =
        text_.substr(at_, end - at_).find_first_not_of(kSpace) == std::string_view::npos;
    at_ = std::min(end + 1, text_.size());
    if (empty) return;
  }
}

std::size_t LegacyVtkScanner::count(std::size_t least_bytes) {
  const std::string text = word();
  std::size_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) {
    fail("\"" + text.substr(0, 40) + "\" is not a count");
  }
  if (value > text_.size() / std::max<std::size_t>(least_bytes, 1) + 1) {
    fail("truncated: it claims " + text + " items, more than its " + std::to_string(text_.size()) +
         " bytes can hold");
  }
  return value;
}

std::vector<double> LegacyVtkScanner::numbers(const std::string& type, std::size_t count) {
  if (binary_) return binary_numbers(type, count);
  std::vector<double> values;
  for (std::size_t i = 0; i < count; ++i) {
    const std::string text = word();
    if (text.empty()) fail("truncated: it ends within an array of " + type);
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) {
      fail("\"" + text.substr(0, 40) + "\" is not a number");
    }
    values.push_back(value);
  }
  return values;
}

std::vector<double> LegacyVtkScanner::binary_numbers(const std::string& type, std::size_t count) {
  const ScalarType stored = type_of(type, *this);
  const std::size_t width = bytes_of(stored);
  skip_line();  // the values begin behind the line that announces them
  if (count > rest().size() / width) fail("truncated: it ends within an array of " + type);
  std::vector<double> values = with_scalar_type(
      stored, [&](auto zero) { return decode<decltype(zero)>(rest().data(), count); });
  at_ += count * width;
  return values;
}

void LegacyVtkScanner::fail(const std::string& message) const {
  throw BadDataError(name_ + ": " + message);
}

}  // namespace organbake
