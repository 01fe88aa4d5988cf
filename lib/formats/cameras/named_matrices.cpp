// SPDX-License-Identifier: GPL-3.0-or-later
// The named matrices of a calibration's document, whatever writes it: OpenCV's file storage as YAML
// or XML (its documentation, "File Storage"), JSON, and .ini. In: the text; out: names without
// signs and capitals, numbers, words, and parts of the same kind. Nothing is made of them here.
#include <yaml-cpp/yaml.h>
#include <algorithm>
#include <sstream>
#include <utility>

#include "cameras/camera_formats.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/formats/lens_files.h"
#include "xml_parser.h"

namespace organbake {
namespace fs = std::filesystem;
namespace {

// Why what has a name is no matrix, by its header.
std::string unlike_header(const std::string& rows, const std::string& columns, std::size_t count) {
  return "says " + rows + " rows and " + columns + " columns, and holds " + std::to_string(count) +
         " numbers";
}

constexpr std::size_t kMostBytes = std::size_t{1} << 20;

std::optional<double> number_of(const YAML::Node& node) {
  double value = 0;
  if (!node.IsScalar() || !YAML::convert<double>::decode(node, value)) return std::nullopt;
  return value;
}

// [1, 2, 3], or [[1, 2], [3, 4]], and nothing deeper: an alias may stand for the list it is in.
// `fault` says why it is nothing.
std::optional<NamedMatrices::Matrix> rows_of_sequence(const YAML::Node& node, std::string& fault,
                                                      int levels = 2) {
  NamedMatrices::Matrix rows;
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

std::optional<NamedMatrices::Matrix> matrix_of(const YAML::Node& node, std::string& fault) {
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

int written_side(const NamedMatrices& found, Names names, int otherwise) {
  const auto number = found.number(names);
  return number ? written_size(*number) : otherwise;
}

// What stands under the first of these names that is there.
template <class Value>
const Value* first_of(const std::map<std::string, Value>& named, Names names) {
  for (const char* name : names)
    if (const auto found = named.find(name); found != named.end()) return &found->second;
  return nullptr;
}

// Nothing where there is anything but numbers, or more than a lens's matrix has.
std::optional<std::vector<double>> numbers_in(std::string_view text) {
  constexpr const char* kSpace = " \t\r\n,";
  std::vector<double> values;
  for (std::size_t at = 0; (at = text.find_first_not_of(kSpace, at)) != text.npos;) {
    const std::size_t end = std::min(text.find_first_of(kSpace, at), text.size());
    const std::size_t first = at + (text[at] == '+' ? 1 : 0);
    const auto value = number_in<double>(text.substr(first, end - first));
    if (!value || values.size() == kMostMatrixValues) return std::nullopt;
    values.push_back(*value);
    at = end;
  }
  return values.empty() ? std::nullopt : std::optional(std::move(values));
}

// opencv_storage / name / rows, cols, data. What lies deeper are sequences of sequences, and other
// structures, of which no lens is made.
class OpenCvXml : public XmlParser {
 public:
  OpenCvXml(NamedMatrices& found, const std::filesystem::path& path)
      : XmlParser(path), found_(found), path_(path) {}

 private:
  static constexpr std::size_t kNamed = 2, kPart = 3;  // how deep they lie

  void open(const std::string& name, XmlAttributes) override {
    ++depth_;
    if (depth_ == kNamed) {
      name_ = plain_name(name);
      parts_.clear();
      text_.clear();
    }
    if (depth_ == kPart) {
      part_ = name;
      text_.clear();
    }
  }

  void add(std::string_view text) override {
    if (depth_ == kNamed || depth_ == kPart) text_ += text;
  }

  void close() override {
    if (depth_ == kPart) parts_[part_] += std::exchange(text_, {});
    if (depth_ == kNamed) parts_.empty() ? take_plain() : take_matrix();
    --depth_;
  }

  // A number, a list of numbers, or a word.
  void take_plain() {
    const std::string word = trimmed(text_, " \t\r\n\"");
    if (word.empty()) return;
    found_.words[name_] = word;
    auto values = numbers_in(text_);
    if (!values) return;
    if (values->size() == 1) found_.numbers[name_] = values->front();
    const auto count = static_cast<double>(values->size());
    if (auto rows = shaped(std::move(*values), 1, count)) found_.matrices[name_] = std::move(*rows);
  }

  void take_matrix() {
    if (!parts_.contains("data")) return;
    auto values = numbers_in(parts_["data"]);
    if (!values) {
      found_.faults[name_] =
          unreadable(path_, name_, "holds no numbers, something else, or more than a lens has");
      return;
    }
    const auto height = numbers_in(parts_["rows"]), width = numbers_in(parts_["cols"]);
    const std::size_t count = values->size();
    auto rows = height && width ? shaped(std::move(*values), height->front(), width->front())
                                : std::nullopt;
    if (rows) {
      found_.matrices[name_] = std::move(*rows);
    } else {
      found_.faults[name_] =
          unreadable(path_, name_, unlike_header(parts_["rows"], parts_["cols"], count));
    }
  }

  NamedMatrices& found_;
  const std::filesystem::path& path_;
  std::size_t depth_ = 0;
  std::string name_, part_, text_;
  std::map<std::string, std::string> parts_;  // of the matrix that is open
};

}  // namespace

bool is_any_of(const std::string& word, Names known) {
  return std::find(known.begin(), known.end(), word) != known.end();
}

std::string plain_name(const std::string& name) {
  std::string plain = lower_case(name);
  std::erase_if(plain, [](char c) { return c == '_' || c == '-' || c == ' '; });
  return plain;
}

std::optional<NamedMatrices::Matrix> shaped(std::vector<double> values, double height,
                                            double width) {
  const auto most = static_cast<double>(values.size());
  if (!(height >= 1 && height <= most) || height * width != most) return std::nullopt;
  return NamedMatrices::Matrix{std::move(values), static_cast<int>(height),
                               static_cast<int>(width)};
}

const NamedMatrices::Matrix* NamedMatrices::find(Names names) const {
  for (const char* name : names) {
    const auto found = matrices.find(name);
    if (found != matrices.end()) return &found->second;
    const auto fault = faults.find(name);
    if (fault != faults.end()) throw BadDataError(fault->second);
  }
  return nullptr;
}

const NamedMatrices* NamedMatrices::part(Names names) const { return first_of(parts, names); }

std::optional<double> NamedMatrices::number(Names names) const {
  const double* found = first_of(numbers, names);
  return found ? std::optional(*found) : std::nullopt;
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

void add_opencv_document(const fs::path& path, NamedMatrices& found) {
  add_opencv_text(read_text_file(path, kMostBytes), path, found);
}

void add_opencv_text(const std::string& text, const fs::path& path, NamedMatrices& found) {
  if (text.size() > kMostBytes) throw BadDataError(path, "is too long for a calibration");
  refuse_foreign_calibration(text, path);
  const char first = first_letter(text);
  if (first == '<') {
    add_opencv_xml(text, path, found);
  } else if (first == '[') {
    add_ini(text, path, found);
  } else {
    add_yaml(text, path, found);
  }
}

NamedMatrices::Matrix read_matrix_file(const fs::path& path) {
  NamedMatrices::Matrix rows;
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

void add_opencv_xml(std::string_view xml, const std::filesystem::path& path, NamedMatrices& found) {
  OpenCvXml(found, path).parse(xml, true);
}

}  // namespace organbake
