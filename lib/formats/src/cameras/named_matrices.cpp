// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/formats/named_matrices.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <sstream>

#include "cameras/foreign_calibration.h"
#include "cameras/opencv_xml.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"

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
// `fault` says why it is nothing.
std::optional<NamedMatrices::Rows> rows_of_sequence(const YAML::Node& node, std::string& fault,
                                                    int levels = 2) {
  NamedMatrices::Rows rows;
  fault = "holds something else than a lens's numbers";
  if (levels == 0 || node.size() == 0 || node.size() > kMostMatrixValues) return std::nullopt;
  for (const YAML::Node& item : node) {
    if (item.IsSequence()) {
      const auto row = rows_of_sequence(item, fault, levels - 1);
      if (!row || row->rows != 1 || (rows.rows > 0 && row->columns != rows.columns))
        return std::nullopt;
      rows.values.insert(rows.values.end(), row->values.begin(), row->values.end());
      rows.columns = row->columns;
      ++rows.rows;
    } else if (const auto value = number_of(item)) {
      rows.values.push_back(*value);
    } else {
      if (item.IsScalar()) fault = "holds '" + item.Scalar() + "', which is no number";
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

std::optional<NamedMatrices::Rows> matrix_of(const YAML::Node& node, std::string& fault) {
  if (node.IsSequence()) return rows_of_sequence(node, fault);
  auto rows = rows_of_sequence(node["data"], fault);
  if (!rows || !node["rows"] || !node["cols"]) return rows;
  const auto height = number_of(node["rows"]), width = number_of(node["cols"]);
  fault = unlike_header(node["rows"].Scalar(), node["cols"].Scalar(), rows->values.size());
  if (!height || !width) return std::nullopt;
  return shaped(std::move(rows->values), *height, *width);
}

void add_node(const YAML::Node& root, const fs::path& path, int levels, NamedMatrices& found) {
  for (const auto& item : root) {
    const YAML::Node& node = item.second;
    const auto key = item.first.as<std::string>();
    const std::string name = plain_name(key);
    if (const auto value = number_of(node)) found.numbers[name] = *value;
    if (node.IsScalar()) found.words[name] = node.Scalar();
    if (node.IsSequence() || (node.IsMap() && node["data"] && node["data"].IsSequence())) {
      std::string fault;
      if (auto matrix = matrix_of(node, fault)) {
        found.matrices[name] = std::move(*matrix);
      } else {
        found.faults[name] = unreadable(path, key, fault);
      }
    } else if (node.IsMap() && levels > 1) {
      add_node(node, path, levels - 1, found.parts[name]);
    }
  }
}

void add_yaml(std::string text, const fs::path& path, NamedMatrices& found) {
  // yaml-cpp refuses OpenCV's "%YAML:1.0".
  if (text.starts_with("%YAML")) text.erase(0, text.find('\n'));
  constexpr int kLevels = 3;  // of parts in parts; an alias may stand for what it is in
  try {
    const YAML::Node root = YAML::Load(text);
    if (!root.IsMap()) throw BadDataError(path, "holds no named matrices of a calibration");
    add_node(root, path, kLevels, found);
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
LensModel model_of(const NamedMatrices& found, const fs::path& path) {
  const auto word = [&](const char* name) {
    const auto at = found.words.find(name);
    return at == found.words.end() ? std::string() : plain_name(at->second);
  };
  const auto is_fisheye = [](const std::string& name) {
    return is_any_of(name, {"equidistant", "equi", "fisheye", "kannalabrandt", "kannalabrandt4",
                            "kb4", "opencvfisheye"});
  };
  const std::string distortion = word("distortionmodel"), lens = word("cameramodel");
  if (is_fisheye(distortion) || is_fisheye(lens) ||
      found.number({"fisheyemodel", "isfisheye"}).value_or(0) != 0)
    return LensModel::fisheye;
  std::string other;
  if (!is_any_of(distortion, {"", "plumbbob", "rationalpolynomial", "radtan", "radialtangential",
                              "brown", "brownconrady", "opencv", "none"}))
    other = distortion;
  for (const char* wide : {"fisheye", "equidistant", "omni", "ocam", "kannala", "scaramuzza",
                           "eucm", "doublesphere", "ds"})
    if (lens == wide || (lens.find(wide) != lens.npos && std::strlen(wide) > 3)) other = lens;
  if (!other.empty())
    throw BadDataError(path, "is of the lens model \"" + other +
                                 "\", which is not supported; calibrate it as a pinhole with k1 k2 "
                                 "p1 p2 k3, or as OpenCV's fisheye with k1 k2 k3 k4");
  return LensModel::brown;
}

void check_distortion(const NamedMatrices::Rows& d, const fs::path& path) {
  for (const double value : d.values)
    if (!std::isfinite(value))
      throw BadDataError(path, "its distortion holds a number that is not finite");
}

void set_fisheye(const NamedMatrices::Rows& d, Intrinsics& lens, const fs::path& path) {
  lens.model = LensModel::fisheye;
  if (d.values.size() != 4)
    throw BadDataError(path, "its distortion has " + std::to_string(d.values.size()) +
                                 " numbers; a fisheye's has four: k1 k2 k3 k4");
  lens.k1 = d.values[0];
  lens.k2 = d.values[1];
  lens.k3 = d.values[2];
  lens.k4 = d.values[3];
}

// OpenCV's order: k1 k2 p1 p2, k3, k4 k5 k6, s1…s4, τx τy.
void set_brown(const NamedMatrices::Rows& d, Intrinsics& lens, const fs::path& path) {
  const std::size_t count = d.values.size();
  const bool none = std::all_of(d.values.begin(), d.values.end(), [](double v) { return v == 0; });
  if (none) return;
  if (count != 4 && count != 5 && count != 8 && count != 12 && count != 14)
    throw BadDataError(path, "its distortion has " + std::to_string(count) +
                                 " numbers; OpenCV's have 4, 5, 8, 12 or 14: k1 k2 p1 p2 (k3 …)");
  double* const target[] = {&lens.k1, &lens.k2, &lens.p1, &lens.p2, &lens.k3};
  for (std::size_t i = 0; i < count; ++i) {
    if (i < std::size(target)) *target[i] = d.values[i];
    if (i >= std::size(target) && d.values[i] != 0)
      throw BadDataError(
          path,
          "only k1 k2 p1 p2 k3 of a distortion are supported, no rational model with "
          "k4 k5 k6, thin prism or tilt; calibrate it without them");
  }
}

// [fx s cx; 0 fy cy; 0 0 1].
void check_camera_matrix(const NamedMatrices::Rows& k, const fs::path& path) {
  if (k.values.size() != 9) throw BadDataError(path, "a camera matrix must be 3x3");
  const std::vector<double>& m = k.values;
  constexpr double kNoSkew = 1e-3;  // of the focal length: no pixel of a picture shows it
  if (m[3] != 0 || m[6] != 0 || m[7] != 0 || m[8] != 1)
    throw BadDataError(path,
                       "its camera matrix is not of the form fx 0 cx, 0 fy cy, 0 0 1 (is it "
                       "transposed?)");
  if (!(std::abs(m[1]) <= kNoSkew * std::abs(m[0])))
    throw BadDataError(path, "its camera matrix has a skew of " + to_text(m[1]) +
                                 ", which is not supported; calibrate it without one");
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
    const auto fault = faults.find(name);
    if (fault != faults.end()) throw BadDataError(fault->second);
  }
  return nullptr;
}

const NamedMatrices* NamedMatrices::part(std::initializer_list<const char*> names) const {
  for (const char* name : names) {
    const auto found = parts.find(name);
    if (found != parts.end()) return &found->second;
  }
  return nullptr;
}

std::string unlike_header(const std::string& rows, const std::string& columns, std::size_t count) {
  return "says " + rows + " rows and " + columns + " columns, and holds " + std::to_string(count) +
         " numbers";
}

std::string unreadable(const fs::path& path, const std::string& name, const std::string& fault) {
  return path.string() + ": its '" + name + "' " + fault;
}

void refuse_unread_distortion(const NamedMatrices& found, const fs::path& path) {
  const auto is_unknown = [](const std::string& name) {
    if (!name.starts_with("dist")) return false;
    for (const auto& known : {kDistortion, kLeftDistortion, kRightDistortion})
      if (is_any_of(name, known)) return false;
    return true;
  };
  for (const auto& [name, fault] : found.faults)
    if (is_unknown(name)) throw BadDataError(fault);
  for (const auto& [name, rows] : found.matrices)
    if (is_unknown(name) && std::any_of(rows.values.begin(), rows.values.end(),
                                        [](double value) { return value != 0; }))
      throw BadDataError(path, "holds '" + name +
                                   "', which is not known as a distortion; name it "
                                   "distortion_coefficients (D1 and D2 of two eyes)");
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
  refuse_foreign_calibration(text, path);
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first != text.npos && text[first] == '<') {
    add_opencv_xml(text, path, found);
  } else if (first != text.npos && text[first] == '[') {
    add_ini(text, path, found);
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
  const LensModel model = model_of(found, path);
  check_camera_matrix(k, path);
  set_opencv_pinhole(k.values[0], k.values[4], k.values[2], k.values[5], lens);
  if (!d) {
    refuse_unread_distortion(found, path);
    if (model == LensModel::fisheye)
      throw BadDataError(path, "is of a fisheye, but lacks its k1 k2 k3 k4");
    return lens;
  }
  check_distortion(*d, path);
  model == LensModel::fisheye ? set_fisheye(*d, lens, path) : set_brown(*d, lens, path);
  return lens;
}

}  // namespace organbake
