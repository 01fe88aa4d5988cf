// SPDX-License-Identifier: GPL-3.0-or-later
// How VTK XML files write the numbers of an array (VTK's file formats, "XML File Formats").
#include "organbake/formats/vtk_xml.h"

#include <zlib.h>
#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstring>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "xml_parser.h"

namespace organbake {
namespace {

const std::map<std::string, ScalarType> kTypes = {
    {"Int8", ScalarType::int8},      {"UInt8", ScalarType::uint8},
    {"Int16", ScalarType::int16},    {"UInt16", ScalarType::uint16},
    {"Int32", ScalarType::int32},    {"UInt32", ScalarType::uint32},
    {"Int64", ScalarType::int64},    {"UInt64", ScalarType::uint64},
    {"String", ScalarType::int8},    {"Float32", ScalarType::float32},
    {"Float64", ScalarType::float64}};

std::string value_of(const XmlAttributes& attributes, const char* name) {
  const auto found = attributes.find(name);
  return found == attributes.end() ? std::string() : found->second;
}

bool is_space(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

// The next number of a text; false at its end. `sound` falls where there is something else. A
// number too small for its type is 0, one too large is none.
template <class Number>
bool next_number(const char*& at, const char* end, Number& number, bool& sound) {
  while (at < end && is_space(*at)) ++at;
  if (at == end) return false;
  const auto [rest, error] = std::from_chars(at, end, number);
  sound = error == std::errc();
  if (std::is_floating_point_v<Number> && error == std::errc::result_out_of_range) {
    const std::string_view word(at, static_cast<std::size_t>(rest - at));
    sound = word.find("e-") != word.npos || word.find("E-") != word.npos;
    number = 0;
  }
  at = rest;
  return sound;
}

// Bytes of an array one after the other, from base64 or as they are. Fewer come where it ends. A
// header may be encoded apart from its data, as VTK does it with packed arrays, or together with
// them: what is encoded apart is filled up to whole groups of letters, so that no group holds both.
class EncodedBytes {
 public:
  EncodedBytes(std::string_view text, bool base64) : rest_(text), base64_(base64) {}

  std::string take(std::size_t count) {
    if (!base64_) {
      std::string taken(rest_.substr(0, count));
      rest_.remove_prefix(taken.size());
      return taken;
    }
    while (ready_.size() < count && take_base64_group(rest_, ready_)) {
    }
    std::string taken = ready_.substr(0, count);
    ready_.erase(0, taken.size());
    return taken;
  }

 private:
  std::string_view rest_;
  const bool base64_;
  std::string ready_;
};

// The counts before an array's bytes.
class HeaderWords {
 public:
  HeaderWords(EncodedBytes& bytes, std::size_t width, bool swapped)
      : bytes_(bytes), width_(width), swapped_(swapped) {}

  // Nothing at the end of the data.
  std::optional<std::uint64_t> next() {
    std::string word = bytes_.take(width_);
    if (word.size() < width_) return std::nullopt;
    if (swapped_) std::reverse(word.begin(), word.end());
    std::uint64_t value = 0;
    std::memcpy(&value, word.data(), width_);
    return value;
  }

 private:
  EncodedBytes& bytes_;
  std::size_t width_;
  bool swapped_;
};

// Blocks of zlib: how many, how large they are, how large the last is (0: as the others), then how
// long each is packed.
std::optional<std::string> inflated(EncodedBytes& bytes, HeaderWords& header, std::size_t most) {
  constexpr std::uint64_t kDeflateRatio = 1040;
  const auto blocks = header.next(), size = header.next(), last = header.next();
  if (!last || *blocks > most || *size > most * kDeflateRatio || *last > *size) return std::nullopt;
  std::vector<std::uint64_t> packed;
  for (std::uint64_t b = 0; b < *blocks; ++b) {
    const auto length = header.next();
    if (!length || *length > most) return std::nullopt;
    packed.push_back(*length);
  }
  std::string all;
  for (std::size_t b = 0; b < packed.size(); ++b) {
    const std::string block = bytes.take(static_cast<std::size_t>(packed[b]));
    const std::uint64_t whole = b + 1 == packed.size() && *last > 0 ? *last : *size;
    if (block.size() < packed[b] || whole > block.size() * kDeflateRatio) return std::nullopt;
    const std::size_t at = all.size();
    all.resize(at + static_cast<std::size_t>(whole));
    uLongf length = whole;
    if (uncompress(reinterpret_cast<Bytef*>(&all[at]), &length,
                   reinterpret_cast<const Bytef*>(block.data()), block.size()) != Z_OK ||
        length != whole)
      return std::nullopt;
  }
  return all;
}

std::optional<std::string> plain(EncodedBytes& bytes, HeaderWords& header, std::size_t most) {
  const auto count = header.next();
  if (!count || *count > most) return std::nullopt;
  std::string all = bytes.take(static_cast<std::size_t>(*count));
  return all.size() == *count ? std::optional(std::move(all)) : std::nullopt;
}

}  // namespace

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
  const auto number = number_in<std::size_t>(written->second);
  if (!number) fail(name + " is \"" + written->second + "\", which is no count");
  return *number;
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

VtkXmlNumbers VtkXmlFile::numbers(const VtkXmlArray& array,
                                  std::optional<std::size_t> count) const {
  const std::string what = "its array \"" + array.name + "\" ";
  const std::string name = value_of(array.attributes, "type");
  const auto type = kTypes.find(name);
  if (type == kTypes.end()) fail(what + "is of the unknown type \"" + name + "\"");
  VtkXmlNumbers found{type->second, 0, {}};
  const std::string format = value_of(array.attributes, "format");
  const bool swapped = value_of(file_, "byte_order") == "BigEndian";
  if (format.empty() || format == "ascii") {
    bool sound = true;
    with_scalar_type(found.type, [&](auto zero) {
      // A byte is written as a number, not as a letter.
      using Number = std::conditional_t<sizeof(zero) == 1, int, decltype(zero)>;
      const char *at = array.text.data(), *end = at + array.text.size();
      for (Number number{}; next_number(at, end, number, sound); ++found.count) {
        const auto stored = static_cast<decltype(zero)>(number);
        const auto* bytes = reinterpret_cast<const std::byte*>(&stored);
        found.bytes.insert(found.bytes.end(), bytes, bytes + sizeof stored);
      }
    });
    if (!sound) fail(what + "holds something that is no number of its type");
  } else {
    const bool appended = format == "appended";
    const std::size_t offset = appended ? this->count(array.attributes, "offset") : 0;
    if (appended && (appended_at_ == 0 || offset > bytes_.size() - appended_at_))
      fail(what + "lies behind the file's end");
    const std::string_view text =
        appended ? std::string_view(bytes_).substr(appended_at_ + offset) : array.text;
    EncodedBytes bytes(text, !appended || appended_.at("encoding") == "base64");
    HeaderWords header(bytes, value_of(file_, "header_type") == "UInt64" ? 8 : 4, swapped);
    const std::string compressor = value_of(file_, "compressor");
    if (!compressor.empty() && compressor != "vtkZLibDataCompressor")
      fail("is packed by " + compressor + "; save it with zlib or not packed");
    const auto data = compressor.empty() ? plain(bytes, header, text.size())
                                         : inflated(bytes, header, text.size());
    if (!data) fail(what + "is damaged or cut off");
    found.count = data->size() / bytes_of(found.type);
    const auto* first = reinterpret_cast<const std::byte*>(data->data());
    found.bytes.assign(first, first + found.count * bytes_of(found.type));
    if (swapped) swap_bytes(found.bytes.data(), found.count, found.type);
  }
  if (count && found.count != *count)
    fail("truncated: " + what + "holds " + std::to_string(found.count) + " numbers, " +
         std::to_string(*count) + " are wanted");
  return found;
}

std::vector<double> VtkXmlNumbers::as_doubles() const {
  std::vector<double> all(count);
  with_scalar_type(type, [&](auto zero) {
    for (std::size_t i = 0; i < count; ++i)
      all[i] = static_cast<double>(bytes_as<decltype(zero)>(&bytes[i * sizeof zero]));
  });
  return all;
}

}  // namespace organbake
