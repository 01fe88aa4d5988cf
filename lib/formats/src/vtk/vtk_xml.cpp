// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/formats/vtk_xml.h"

#include <algorithm>
#include <charconv>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "text/xml_parser.h"

namespace organbake {

class VtkXmlParser : public XmlParser {
 public:
  VtkXmlParser(VtkXmlFile& file, const std::filesystem::path& path, const std::string& kind)
      : XmlParser(path), file_(file), kind_(kind) {}

 private:
  // VTKFile / data set / Piece / section / DataArray, and VTKFile / data set / FieldData / Array;
  // whatever else there is, is passed over.
  void open(const std::string& name, XmlAttributes attributes) override {
    constexpr std::size_t kFile = 0, kDataSet = 1, kPiece = 2, kSection = 3, kArray = 4;
    const std::size_t depth = path_.size();
    const bool inside = depth == known_;
    path_.push_back(name);
    if (!inside) return;
    if (depth == kFile && name == "VTKFile") {
      file_.file_ = std::move(attributes);
    } else if (depth == kDataSet && name == kind_) {
      file_.data_set_ = std::move(attributes);
    } else if (depth == kPiece && name == "Piece") {
      file_.pieces_.emplace_back().attributes = std::move(attributes);
    } else if (depth == kPiece && name == "FieldData") {
      // Its arrays follow.
    } else if (depth == kSection && path_[kPiece] == "FieldData") {
      open_array(file_.fields_, std::move(attributes));
    } else if (depth == kSection) {
      file_.pieces_.back().sections[name].attributes = std::move(attributes);
    } else if (depth == kArray && name == "DataArray") {
      open_array(file_.pieces_.back().sections[path_[kSection]], std::move(attributes));
    } else {
      return;
    }
    known_ = depth + 1;
  }

  void open_array(VtkXmlPiece::Section& section, XmlAttributes attributes) {
    VtkXmlArray& array = section.arrays.emplace_back();
    array.name = attributes["Name"];
    const std::string& components = attributes["NumberOfComponents"];
    std::from_chars(components.data(), components.data() + components.size(), array.components);
    array.attributes = std::move(attributes);
    text_ = &array.text;
    text_depth_ = path_.size();
  }

  void close() override {
    if (path_.size() == text_depth_) text_ = nullptr;
    path_.pop_back();
    known_ = std::min(known_, path_.size());
  }

  void add(std::string_view characters) override {
    if (text_ && path_.size() == text_depth_) *text_ += characters;
  }

  VtkXmlFile& file_;
  const std::string kind_;
  std::vector<std::string> path_;  // of the element that is open
  std::size_t known_ = 0;          // how many of its names are those that are looked for
  std::string* text_ = nullptr;    // of the array that is open, and how deep that lies
  std::size_t text_depth_ = 0;
};

VtkXmlFile::VtkXmlFile(const std::filesystem::path& path, const std::string& kind) : path_(path) {
  bytes_ = read_text_file(path, std::size_t{1} << 36);
  const std::string_view bytes = bytes_;
  const std::size_t appended = bytes.find("<AppendedData");
  VtkXmlParser parser(*this, path, kind);
  parser.parse(bytes.substr(0, appended), appended == bytes.npos);
  if (appended != bytes.npos) {
    const std::size_t tag_end = bytes.find('>', appended), mark = bytes.find('_', tag_end);
    if (tag_end == bytes.npos || mark == bytes.npos) fail("its appended data is missing");
    const std::string_view tag = bytes.substr(appended, tag_end - appended);
    appended_["encoding"] = tag.find("raw") != tag.npos ? "raw" : "base64";
    appended_at_ = mark + 1;
  }
  if (file_.empty() || file_["type"] != kind || pieces_.empty())
    fail("is no VTK XML file that holds a piece of " + kind);
}

void VtkXmlFile::fail(const std::string& message) const { throw BadDataError(path_, message); }

std::size_t VtkXmlFile::count(const XmlAttributes& attributes, const std::string& name) const {
  const auto written = attributes.find(name);
  if (written == attributes.end()) return 0;
  std::size_t number = 0;
  const char* const end = written->second.data() + written->second.size();
  const auto [rest, error] = std::from_chars(written->second.data(), end, number);
  if (error != std::errc() || rest != end)
    fail(name + " is \"" + written->second + "\", which is no count");
  return number;
}

std::string VtkXmlFile::field_text(std::string_view name) const {
  const VtkXmlArray* array = fields_.find(name);
  if (!array) return {};
  const VtkXmlNumbers letters = numbers(*array, std::nullopt);
  const auto* text = reinterpret_cast<const char*>(letters.bytes.data());
  return {text, std::find(text, text + letters.bytes.size(), '\0')};
}

const VtkXmlArray* VtkXmlPiece::Section::find(std::string_view name) const {
  for (const VtkXmlArray& array : arrays)
    if (array.name == name) return &array;
  return nullptr;
}

}  // namespace organbake
