// SPDX-License-Identifier: GPL-3.0-or-later
#include "stereo/named_matrices.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cctype>
#include <sstream>

#include "core/error.h"
#include "core/files.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostBytes = std::size_t{1} << 20;
constexpr std::size_t kMostValues = 64;  // of a matrix; the largest that counts has 16

std::string plain_name(const std::string& name) {
  std::string plain;
  for (const char c : name)
    if (c != '_' && c != '-')
      plain += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return plain;
}

std::optional<double> number_of(const YAML::Node& node) {
  double value = 0;
  if (!node.IsScalar() || !YAML::convert<double>::decode(node, value)) return std::nullopt;
  return value;
}

// [1, 2, 3], or [[1, 2], [3, 4]], and nothing deeper: an alias may stand for the list it is in.
std::optional<NamedMatrices::Rows> rows_of_sequence(const YAML::Node& node, int levels = 2) {
  NamedMatrices::Rows rows;
  if (levels == 0 || node.size() == 0 || node.size() > kMostValues) return std::nullopt;
  for (const YAML::Node& item : node) {
    if (item.IsSequence()) {
      const auto row = rows_of_sequence(item, levels - 1);
      if (!row || row->rows != 1 || (rows.rows > 0 && row->columns != rows.columns))
        return std::nullopt;
      rows.values.insert(rows.values.end(), row->values.begin(), row->values.end());
      rows.columns = row->columns;
      ++rows.rows;
    } else if (const auto value = number_of(item)) {
      rows.values.push_back(*value);
    } else {
      return std::nullopt;
    }
  }
  if (rows.rows == 0) {
    rows.rows = 1;
    rows.columns = static_cast<int>(rows.values.size());
  }
  if (rows.values.size() != std::size_t(rows.rows) * rows.columns) return std::nullopt;
  return rows;
}

std::optional<NamedMatrices::Rows> matrix_of(const YAML::Node& node) {
  if (node.IsSequence()) return rows_of_sequence(node);
  if (!node.IsMap() || !node["data"] || !node["data"].IsSequence()) return std::nullopt;
  auto rows = rows_of_sequence(node["data"]);
  if (!rows || !node["rows"] || !node["cols"]) return rows;
  const auto height = number_of(node["rows"]), width = number_of(node["cols"]);
  const auto most = static_cast<double>(rows->values.size());
  if (!height || !width || !(*height >= 1 && *height <= most) || *height * *width != most)
    return std::nullopt;
  rows->rows = static_cast<int>(*height);
  rows->columns = static_cast<int>(*width);
  return rows;
}

}  // namespace

const NamedMatrices::Rows* NamedMatrices::find(std::initializer_list<const char*> names) const {
  for (const char* name : names) {
    const auto found = matrices.find(name);
    if (found != matrices.end()) return &found->second;
  }
  return nullptr;
}

std::optional<double> NamedMatrices::number(std::initializer_list<const char*> names) const {
  for (const char* name : names) {
    const auto found = numbers.find(name);
    if (found != numbers.end()) return found->second;
  }
  return std::nullopt;
}

void add_opencv_document(const fs::path& path, NamedMatrices& found) {
  std::string text = read_text_file(path, kMostBytes);
  // yaml-cpp refuses OpenCV's "%YAML:1.0".
  if (text.starts_with("%YAML")) text.erase(0, text.find('\n'));
  try {
    const YAML::Node root = YAML::Load(text);
    if (!root.IsMap()) throw BadDataError(path, "holds no named matrices of a calibration");
    for (const auto& item : root) {
      const std::string name = plain_name(item.first.as<std::string>());
      if (const auto value = number_of(item.second)) found.numbers[name] = *value;
      if (auto matrix = matrix_of(item.second)) found.matrices[name] = std::move(*matrix);
    }
  } catch (const YAML::Exception& error) {
    throw BadDataError(path, "is no OpenCV calibration: " + error.msg);
  }
}

NamedMatrices::Rows read_rows(const fs::path& path) {
  NamedMatrices::Rows rows;
  std::istringstream text(read_text_file(path, kMostBytes));
  for (std::string line; std::getline(text, line);) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream words(line);
    int count = 0;
    for (double value = 0; words >> value; ++count) rows.values.push_back(value);
    words.clear();
    std::string rest;
    if (words >> rest) throw BadDataError(path, "'" + rest + "' is no number");
    if (count == 0) continue;
    if (rows.rows > 0 && count != rows.columns)
      throw BadDataError(path, "its rows are of unlike length");
    rows.columns = count;
    ++rows.rows;
    if (rows.values.size() > kMostValues) throw BadDataError(path, "is too long for a calibration");
  }
  if (rows.rows == 0) throw BadDataError(path, "holds no number");
  return rows;
}

}  // namespace organbake
