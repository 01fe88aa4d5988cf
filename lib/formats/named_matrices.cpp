// SPDX-License-Identifier: GPL-3.0-or-later
#include "formats/named_matrices.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cctype>
#include <sstream>

#include "core/error.h"
#include "core/files.h"
#include "formats/opencv_xml.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostBytes = std::size_t{1} << 20;

std::optional<double> number_of(const YAML::Node& node) {
  double value = 0;
  if (!node.IsScalar() || !YAML::convert<double>::decode(node, value)) return std::nullopt;
  return value;
}

// [1, 2, 3], or [[1, 2], [3, 4]], and nothing deeper: an alias may stand for the list it is in.
std::optional<NamedMatrices::Rows> rows_of_sequence(const YAML::Node& node, int levels = 2) {
  NamedMatrices::Rows rows;
  if (levels == 0 || node.size() == 0 || node.size() > kMostMatrixValues) return std::nullopt;
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
  if (!height || !width) return std::nullopt;
  return shaped(std::move(rows->values), *height, *width);
}

void add_yaml(std::string text, const fs::path& path, NamedMatrices& found) {
  // yaml-cpp refuses OpenCV's "%YAML:1.0".
  if (text.starts_with("%YAML")) text.erase(0, text.find('\n'));
  try {
    const YAML::Node root = YAML::Load(text);
    if (!root.IsMap()) throw BadDataError(path, "holds no named matrices of a calibration");
    for (const auto& item : root) {
      const std::string name = plain_name(item.first.as<std::string>());
      if (const auto value = number_of(item.second)) found.numbers[name] = *value;
      if (auto matrix = matrix_of(item.second)) found.matrices[name] = std::move(*matrix);
      if (item.second.IsScalar()) found.words[name] = item.second.Scalar();
    }
  } catch (const YAML::Exception& error) {
    throw BadDataError(path, "is no OpenCV calibration: " + error.msg);
  }
}

int written_side(const NamedMatrices& found, std::initializer_list<const char*> names,
                 int otherwise) {
  const auto number = found.number(names);
  return number ? written_size(*number) : otherwise;
}

bool is_any_of(const std::string& word, std::initializer_list<const char*> known) {
  return std::find(known.begin(), known.end(), word) != known.end();
}

// ROS names the model of a distortion, Kalibr and others that of the whole lens, and OpenCV's own
// calibration program says whether it is a fisheye.
void check_model(const NamedMatrices& found, const fs::path& path) {
  std::string other;
  const auto word = [&](const char* name) {
    const auto at = found.words.find(name);
    return at == found.words.end() ? std::string() : plain_name(at->second);
  };
  if (const std::string model = word("distortionmodel");
      !is_any_of(model, {"", "plumbbob", "rationalpolynomial", "radtan", "radialtangential",
                         "brown", "brownconrady", "opencv", "none"}))
    other = model;
  const std::string lens = word("cameramodel");
  for (const char* wide : {"fisheye", "equidistant", "omni", "ocam", "kannala", "scaramuzza"})
    if (lens.find(wide) != lens.npos) other = lens;
  if (found.number({"fisheyemodel", "isfisheye"}).value_or(0) != 0) other = "fisheye";
  if (!other.empty())
    throw BadDataError(path, "is of the lens model \"" + other +
                                 "\", which is not supported; calibrate it as a pinhole with k1 k2 "
                                 "p1 p2 k3");
}

}  // namespace

std::string plain_name(const std::string& name) {
  std::string plain;
  for (const char c : name)
    if (c != '_' && c != '-' && c != ' ')
      plain += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return plain;
}

std::optional<NamedMatrices::Rows> shaped(std::vector<double> values, double height, double width) {
  const auto most = static_cast<double>(values.size());
  if (!(height >= 1 && height <= most) || height * width != most) return std::nullopt;
  return NamedMatrices::Rows{std::move(values), static_cast<int>(height), static_cast<int>(width)};
}

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
  add_opencv_text(read_text_file(path, kMostBytes), path, found);
}

void add_opencv_text(const std::string& text, const fs::path& path, NamedMatrices& found) {
  if (text.size() > kMostBytes) throw BadDataError(path, "is too long for a calibration");
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first != text.npos && text[first] == '<') {
    add_opencv_xml(text, path, found);
  } else {
    add_yaml(text, path, found);
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
    if (rows.values.size() > kMostMatrixValues)
      throw BadDataError(path, "is too long for a calibration");
  }
  if (rows.rows == 0) throw BadDataError(path, "holds no number");
  return rows;
}

Intrinsics sized_lens(const NamedMatrices& found, int width, int height) {
  Intrinsics lens;
  lens.width = written_side(found, {"imagewidth", "width", "w"}, width);
  lens.height = written_side(found, {"imageheight", "height", "h"}, height);
  const auto* size = found.find({"imagesize", "size", "imgsize", "resolution"});
  if (size && size->values.size() == 2) {
    lens.width = written_size(size->values[0]);
    lens.height = written_size(size->values[1]);
  }
  return lens;
}

void set_opencv_pinhole(double fx, double fy, double cx, double cy, Intrinsics& lens) {
  constexpr double kFromCentreToCorner = 0.5;
  lens.fx = fx;
  lens.fy = fy;
  lens.cx = cx + kFromCentreToCorner;
  lens.cy = cy + kFromCentreToCorner;
}

Intrinsics lens_of_matrices(const NamedMatrices& found, const NamedMatrices::Rows& k,
                            const NamedMatrices::Rows* d, Intrinsics lens, const fs::path& path) {
  check_model(found, path);
  if (k.values.size() != 9) throw BadDataError(path, "a camera matrix must be 3x3");
  set_opencv_pinhole(k.values[0], k.values[4], k.values[2], k.values[5], lens);
  if (!d) return lens;
  double* const target[] = {&lens.k1, &lens.k2, &lens.p1, &lens.p2, &lens.k3};
  for (std::size_t i = 0; i < d->values.size(); ++i) {
    if (i < std::size(target)) *target[i] = d->values[i];
    if (i >= std::size(target) && d->values[i] != 0)
      throw BadDataError(path, "only k1 k2 p1 p2 k3 of a distortion are supported");
  }
  return lens;
}

}  // namespace organbake
