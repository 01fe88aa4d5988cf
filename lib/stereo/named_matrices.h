// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <initializer_list>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace organbake {

// The matrices and numbers that a calibration keeps under names.
struct NamedMatrices {
  struct Rows {
    std::vector<double> values;  // row by row
    int rows = 0, columns = 0;
  };
  std::map<std::string, Rows> matrices;  // names in lower case, without '_' and '-'
  std::map<std::string, double> numbers;

  // The first of these names that is there.
  const Rows* find(std::initializer_list<const char*> names) const;
  std::optional<double> number(std::initializer_list<const char*> names) const;
};

// Adds what an OpenCV file storage (YAML or JSON) holds: its matrices, sequences of numbers or of
// rows, and numbers. Throws BadDataError.
void add_opencv_document(const std::filesystem::path& path, NamedMatrices& found);

// A text of rows of numbers. Throws BadDataError when it holds anything else, or uneven rows.
NamedMatrices::Rows read_rows(const std::filesystem::path& path);

}  // namespace organbake
