// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "organbake/core/scalar_type.h"

namespace organbake {

struct PlyProperty {
  std::string name;
  ScalarType type = ScalarType::float32;
  std::optional<ScalarType> list_count;  // the count's type, for a list
};

struct PlyElement {
  std::string name;
  std::size_t count = 0;
  std::vector<PlyProperty> properties;
};

// The header of a PLY file and then its numbers, one after the other (Turk 1994: ASCII, or binary
// in either byte order). All members throw BadDataError naming the file where it ends early, holds
// no number where one must be, or claims more than its bytes can hold.
class PlyScanner {
 public:
  // Reads the header; numbers begin behind it.
  PlyScanner(std::span<const std::byte> bytes, std::string name);

  const std::string& name() const { return name_; }
  const std::vector<PlyElement>& elements() const { return elements_; }
  // Whether write_ply() wrote it, by its comment.
  bool is_ours() const { return is_ours_; }
  double number(ScalarType type);
  // How many numbers of the property follow: one, or as many as its list says.
  std::size_t count_of(const PlyProperty& property) {
    return property.list_count ? list_length(property) : 1;
  }
  void skip_row(const PlyElement& element);
  [[noreturn]] void fail(const std::string& message) const;

 private:
  std::string_view line();
  ScalarType scalar_type(std::string_view type) const;
  void parse_header();
  void add_element(std::string_view rest);
  void add_property(std::string_view rest);
  template <typename T>
  double binary();
  double ascii_number();
  std::size_t list_length(const PlyProperty& property);

  std::string_view text_;
  std::string name_;
  std::size_t position_ = 0;
  std::vector<PlyElement> elements_;
  bool ascii_ = false;
  bool swaps_ = false;  // bytes are in the other order than the machine's
  bool is_ours_ = false;
};

}  // namespace organbake
