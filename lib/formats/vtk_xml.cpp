// SPDX-License-Identifier: GPL-3.0-or-later
#include "formats/vtk_xml.h"

#include <expat.h>

#include <algorithm>
#include <charconv>
#include <memory>
#include <type_traits>

#include "core/error.h"
#include "core/files.h"

namespace organbake {

// What expat calls while it reads. Its callbacks are C's: nothing may be thrown through them.
class VtkXmlParser {
 public:
  VtkXmlParser(VtkXmlFile& file, const std::string& kind)
      : file_(file), kind_(kind), parser_(XML_ParserCreate(nullptr)) {
    if (!parser_) throw std::bad_alloc();
    XML_SetUserData(parser_.get(), this);
    XML_SetElementHandler(parser_.get(), start, end);
    XML_SetCharacterDataHandler(parser_.get(), text);
  }

  // `whole`: nothing follows it that is no XML.
  void parse(std::string_view xml, bool whole) {
    constexpr std::size_t kLargest = std::size_t{1} << 30;  // expat counts in ints
    if (xml.size() > kLargest)
      file_.fail("its XML is larger than 1 GB; save it with appended data");
    const XML_Status status =
        XML_Parse(parser_.get(), xml.data(), static_cast<int>(xml.size()), whole);
    if (status != XML_STATUS_OK) {
      file_.fail("is no sound XML: line " +
                 std::to_string(XML_GetCurrentLineNumber(parser_.get())) + ": " +
                 XML_ErrorString(XML_GetErrorCode(parser_.get())));
    }
  }

 private:
  struct Free {
    void operator()(XML_Parser parser) const { XML_ParserFree(parser); }
  };

  static void start(void* self, const XML_Char* name, const XML_Char** attributes) {
    XmlAttributes all;
    for (; *attributes; attributes += 2) all[attributes[0]] = attributes[1];
    static_cast<VtkXmlParser*>(self)->open(name, std::move(all));
  }
  static void end(void* self, const XML_Char*) { static_cast<VtkXmlParser*>(self)->close(); }
  static void text(void* self, const XML_Char* characters, int count) {
    static_cast<VtkXmlParser*>(self)->add({characters, static_cast<std::size_t>(count)});
  }

  // VTKFile / data set / Piece / section / DataArray; whatever else there is, is passed over.
  void open(const std::string& name, XmlAttributes attributes) {
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

  void close() {
    path_.pop_back();
    known_ = std::min(known_, path_.size());
  }

  void add(std::string_view characters) {
    constexpr std::size_t kInArray = 5;
    if (known_ == kInArray && path_.size() == kInArray)
      file_.pieces_.back().sections[path_[3]].arrays.back().text += characters;
  }

  VtkXmlFile& file_;
  const std::string kind_;
  std::unique_ptr<std::remove_pointer_t<XML_Parser>, Free> parser_;
  std::vector<std::string> path_;  // of the element that is open
  std::size_t known_ = 0;          // how many of its names are those that are looked for
};

VtkXmlFile::VtkXmlFile(const std::filesystem::path& path, const std::string& kind) : path_(path) {
  bytes_ = read_text_file(path, std::size_t{1} << 36);
  const std::string_view bytes = bytes_;
  const std::size_t appended = bytes.find("<AppendedData");
  VtkXmlParser parser(*this, kind);
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
