// SPDX-License-Identifier: GPL-3.0-or-later
#include "cameras/opencv_xml.h"

#include <algorithm>
#include <charconv>
#include <utility>

#include "organbake/core/text.h"
#include "text/xml_parser.h"

namespace organbake {
namespace {

// Nothing where there is anything but numbers, or more than a lens's matrix has.
std::optional<std::vector<double>> numbers_in(std::string_view text) {
  constexpr const char* kSpace = " \t\r\n,";
  std::vector<double> values;
  for (std::size_t at = 0; (at = text.find_first_not_of(kSpace, at)) != text.npos;) {
    const std::size_t end = std::min(text.find_first_of(kSpace, at), text.size());
    double value = 0;
    const char* first = text.data() + at + (text[at] == '+' ? 1 : 0);
    const auto [stop, error] = std::from_chars(first, text.data() + end, value);
    if (error != std::errc() || stop != text.data() + end || values.size() == kMostMatrixValues)
      return std::nullopt;
    values.push_back(value);
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

void add_opencv_xml(std::string_view xml, const std::filesystem::path& path, NamedMatrices& found) {
  OpenCvXml(found, path).parse(xml, true);
}

}  // namespace organbake
