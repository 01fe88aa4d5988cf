// SPDX-License-Identifier: GPL-3.0-or-later
#include "formats/vtk_xml.h"

#include <algorithm>
#include <charconv>

#include "core/error.h"
#include "core/files.h"
#include "formats/xml_parser.h"

namespace organbake {

class VtkXmlParser : public XmlParser {
 public:
  VtkXmlParser(VtkXmlFile& file, const std::filesystem::path& path, const std::string& kind)
      : XmlParser(path), file_(file), kind_(kind) {}

 private:
  // VTKFile / data set / Piece / section / DataArray; whatever else there is, is passed over.
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
    } else if (depth == kSection) {
      file_.pieces_.back().sections[name].attributes = std::move(attributes);
    } else if (depth == kArray && name == "DataArray") {
      open_array(std::move(attributes));
    } else {
      return;
    }
    known_ = depth + 1;
  }

  void open_array(XmlAttributes attributes) {
    VtkXmlArray array;
    array.name = attributes["Name"];
    const std::string& components = attributes["NumberOfComponents"];
    std::from_chars(components.data(), components.data() + components.size(), array.components);
    array.attributes = std::move(attributes);
    file_.pieces_.back().sections[path_[3]].arrays.push_back(std::move(array));
  }

  void close() override {
    path_.pop_back();
    known_ = std::min(known_, path_.size());
  }

  void add(std::string_view characters) override {
    constexpr std::size_t kInArray = 5;
    if (known_ == kInArray && path_.size() == kInArray)
      file_.pieces_.back().sections[path_[3]].arrays.back().text += characters;
  }

  VtkXmlFile& file_;
  const std::string kind_;
  std::vector<std::string> path_;  // of the element that is open
  std::size_t known_ = 0;          // how many of its names are those that are looked for
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

const VtkXmlArray* VtkXmlPiece::Section::find(std::string_view name) const {
  for (const VtkXmlArray& array : arrays)
    if (array.name == name) return &array;
  return nullptr;
}

}  // namespace organbake
