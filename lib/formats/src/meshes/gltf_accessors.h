// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "organbake/bundle/json_fields.h"
#include "organbake/core/scalar_type.h"

namespace organbake {

// The numbers of a glTF accessor, item by item.
struct GltfNumbers {
  std::size_t items = 0, components = 1;
  std::vector<double> values;  // normalised ones are in −1…1 already
  bool written = true;         // false: zeros, of which the file holds none
};

// A glTF document with its buffers: in the .glb, in the text itself, or in files beside it. All
// members throw BadDataError that names the file and what in it is wrong.
class GltfDocument {
 public:
  explicit GltfDocument(const std::filesystem::path& path);

  JsonField root() const { return {json_, path_.string()}; }
  // Of accessor `index`, which may hold no more than its buffer does.
  GltfNumbers numbers(std::size_t index) const;
  // Bytes of the file and its buffers together.
  std::size_t total_bytes() const { return total_bytes_; }

 private:
  void open(const std::string& bytes);
  void read_buffers();
  std::string buffer_from(const std::string& uri, const JsonField& field) const;
  // `items` of `bytes_each`, `stride` apart, from an offset within a view.
  void read_view(const JsonField& at, std::size_t items, ScalarType type, bool normalized,
                 std::size_t components, std::vector<double>& values) const;

  std::filesystem::path path_;
  Json json_;
  std::string binary_;  // the .glb's own buffer
  std::vector<std::string> buffers_;
  std::size_t total_bytes_ = 0;
};

}  // namespace organbake
