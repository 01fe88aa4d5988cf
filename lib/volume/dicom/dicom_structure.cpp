// SPDX-License-Identifier: GPL-3.0-or-later
// Looks a DICOM file's structure over (PS3.5, 7) before the parser reads it, which trusts lengths
// and nesting. In, a file; out, its first flaw.
#include "dicom/dicom_document.h"

#include <vtkDICOMDictionary.h>

#include <algorithm>
#include <cstdint>
#include <span>
#include <string_view>

#include "files/volume_files.h"

namespace organbake {
namespace {

constexpr std::uint32_t kUndefined = 0xFFFFFFFF;
constexpr std::uint32_t kItem = 0xFFFEE000, kItemEnd = 0xFFFEE00D, kSequenceEnd = 0xFFFEE0DD;
constexpr std::uint32_t kPixelData = 0x7FE00010, kTransferSyntax = 0x00020010,
                        kMetaLength = 0x00020000;
constexpr int kDeepest = 16;

struct Flaw {
  std::string what;
};

// A window of the file that moves on: most elements are short and follow each other.
class Window {
 public:
  explicit Window(const std::filesystem::path& file)
      : file_(file), size_(std::filesystem::file_size(file)) {}

  std::uint64_t size() const { return size_; }
  std::string_view at(std::uint64_t place, std::size_t count) {
    if (place > size_ || count > size_ - place) throw Flaw{"ends within a data element"};
    if (place < begin_ || place + count > begin_ + text_.size()) load(place);
    return std::string_view(text_).substr(static_cast<std::size_t>(place - begin_), count);
  }

 private:
  void load(std::uint64_t place) {
    constexpr std::uint64_t kWindow = 8192;
    text_.resize(static_cast<std::size_t>(std::min(kWindow, size_ - place)));
    ByteStream(file_, ByteStream::Coding::raw, place)
        .read_exactly(std::as_writable_bytes(std::span(text_)));
    begin_ = place;
  }

  std::filesystem::path file_;
  std::uint64_t size_, begin_ = 0;
  std::string text_;
};

struct Element {
  std::uint32_t tag = 0, length = 0;
  std::string vr;           // empty where it is not written
  std::uint64_t value = 0;  // where it begins
};

bool is_letters(std::string_view vr) {
  return vr[0] >= 'A' && vr[0] <= 'Z' && vr[1] >= 'A' && vr[1] <= 'Z';
}

// Of an unknown kind nobody knows how its length is written.
bool is_known(std::string_view vr) {
  static constexpr std::string_view kKnown =
      "AE AS AT CS DA DS DT FD FL IS LO LT OB OD OF OL OV OW PN SH SL SQ SS ST SV TM UC UI UL UN "
      "UR US UT UV ";
  return is_letters(vr) && kKnown.find(std::string(vr) + " ") != kKnown.npos;
}

bool has_long_length(std::string_view vr) {
  static constexpr std::string_view kLong[] = {"OB", "OD", "OF", "OL", "OV", "OW", "SQ",
                                               "SV", "UC", "UN", "UR", "UT", "UV"};
  return std::find(std::begin(kLong), std::end(kLong), vr) != std::end(kLong);
}

// As the parser's own dictionary has it. Its look-up with a file's data would complain, on the
// terminal, of every kind of value that hangs on what this file says elsewhere.
bool is_listed_as_sequence(std::uint32_t tag) {
  const vtkDICOMTag asked(static_cast<unsigned short>(tag >> 16),
                          static_cast<unsigned short>(tag & 0xFFFF));
  const vtkDICOMDictEntry entry = vtkDICOMDictionary::FindDictEntry(asked);
  return entry.IsValid() && entry.GetVR() == vtkDICOMVR::SQ;
}

struct Coding {
  bool is_explicit = true, big_endian = false;
};

class Walker {
 public:
  explicit Walker(const std::filesystem::path& file) : window_(file) {}

  void walk() {
    constexpr std::uint64_t kPreamble = 132;
    const bool with_preamble =
        window_.size() >= kPreamble && window_.at(kPreamble - 4, 4) == "DICM";
    std::uint64_t at = with_preamble ? kPreamble : 0;
    const std::string syntax = walk_meta(at);
    if (with_preamble && at == kPreamble) throw Flaw{"has no meta group"};
    const Coding coding = coding_of_syntax(syntax, at);
    elements(at, window_.size(), coding, false, 0);
  }

 private:
  std::uint32_t number(std::uint64_t at, int count, const Coding& coding) {
    const auto size = static_cast<std::size_t>(count);
    return whole_at(window_.at(at, size), 0, size, coding.big_endian);
  }

  std::uint32_t tag_at(std::uint64_t at, const Coding& coding) {
    return number(at, 2, coding) << 16 | number(at + 2, 2, coding);
  }

  Element element_at(std::uint64_t at, const Coding& coding) {
    Element element{tag_at(at, coding), 0, {}, 0};
    const bool delimiter = element.tag >> 16 == 0xFFFE;
    if (coding.is_explicit && !delimiter) {
      element.vr = window_.at(at + 4, 2);
      if (!is_known(element.vr)) throw Flaw{"holds something that is no data element"};
      const bool is_long = has_long_length(element.vr);
      element.length = is_long ? number(at + 8, 4, coding) : number(at + 6, 2, coding);
      element.value = at + (is_long ? 12 : 8);
    } else {
      element.length = number(at + 4, 4, coding);
      element.value = at + 8;
    }
    return element;
  }

  // The meta group is explicit little-endian in every file. Returns the transfer syntax that it
  // names, empty without such a group; `at` then stands behind it. Where it ends, or what it names,
  // may not be open to two readings: vtk-dicom goes by its length, others by its tags.
  std::string walk_meta(std::uint64_t& at) {
    std::string syntax;
    std::uint64_t told_end = 0;
    const std::uint64_t begin = at;
    while (at + 8 <= window_.size() && number(at, 2, {}) == 0x0002) {
      const Element element = element_at(at, {});
      check_end(element, window_.size());
      if (element.tag == kMetaLength && element.length == 4)
        told_end = element.value + 4 + number(element.value, 4, {});
      if (element.tag == kTransferSyntax) syntax = uid_of(element);
      at = element.value + element.length;
    }
    if (told_end != 0 && told_end != at)
      throw Flaw{"has a meta group of another length than it says"};
    if (at != begin && syntax.empty()) throw Flaw{"does not name its transfer syntax"};
    return syntax;
  }

  std::string uid_of(const Element& element) {
    constexpr std::size_t kLongestUid = 64;
    if (element.length > kLongestUid) throw Flaw{"has a transfer syntax of no sound name"};
    std::string uid(window_.at(element.value, element.length));
    const std::size_t end = std::min(uid.find_first_not_of("0123456789."), uid.size());
    if (uid.find_first_not_of(std::string_view("\0 ", 2), end) != uid.npos)
      throw Flaw{"has a transfer syntax of no sound name"};
    uid.resize(end);
    return uid;
  }

  Coding coding_of_syntax(const std::string& syntax, std::uint64_t at) {
    if (syntax == "1.2.840.10008.1.2" || syntax == "1.2.840.113619.5.2") return {false, false};
    if (syntax == "1.2.840.10008.1.2.2") return {true, true};
    if (!syntax.empty()) return {};
    // Without a meta group the first element shows it.
    const bool is_explicit = at + 8 <= window_.size() && is_letters(window_.at(at + 4, 2));
    return {is_explicit, false};
  }

  static void check_end(const Element& element, std::uint64_t end) {
    if (element.length == kUndefined) throw Flaw{"has an element of no known length"};
    if (element.value > end || element.length > end - element.value)
      throw Flaw{"has an element that reaches beyond what it is in"};
  }

  // Up to `end`, or to the delimiter of an item of undefined length. Returns where they end.
  std::uint64_t elements(std::uint64_t at, std::uint64_t end, const Coding& coding, bool delimited,
                         int depth) {
    constexpr std::uint64_t kLeast = 8;
    if (depth > kDeepest) throw Flaw{"is nested too deeply"};
    while (at < end) {
      if (end - at < kLeast) {
        if (depth > 0) throw Flaw{"has an item that ends within an element"};
        return end;  // padding
      }
      const Element element = element_at(at, coding);
      if (delimited && element.tag == kItemEnd) return element.value;
      if (depth == 0 && element.tag == kPixelData) {
        at = behind_pixels(element, end, coding);
        if (is_padding(at, end)) return end;
        continue;
      }
      at = behind(element, end, coding, depth);
    }
    if (delimited) throw Flaw{"has an item without an end"};
    return at;
  }

  // Plain pixels that are cut off are found by their readers. The parser goes on behind them.
  std::uint64_t behind_pixels(const Element& element, std::uint64_t end, const Coding& coding) {
    if (element.length == kUndefined) return fragments(element.value, end, coding);
    const std::uint64_t left = end - std::min(end, element.value);
    return element.length > left ? end : element.value + element.length;
  }

  bool is_padding(std::uint64_t at, std::uint64_t end) {
    for (; at < end; ++at)
      if (window_.at(at, 1)[0] != '\0') return false;
    return true;
  }

  std::uint64_t behind(const Element& element, std::uint64_t end, const Coding& coding, int depth) {
    const bool undefined = element.length == kUndefined;
    if (!undefined) check_end(element, end);
    const std::uint64_t value_end = undefined ? end : element.value + element.length;
    const bool unknown = element.vr.empty() || element.vr == "UN";
    if (!unknown && element.vr != "SQ" && is_listed_as_sequence(element.tag))
      throw Flaw{"has another value in a sequence's place"};
    const bool by_content =
        unknown && value_end - element.value >= 8 &&
        (tag_at(element.value, coding) == kItem || tag_at(element.value, {false, false}) == kItem);
    if (element.vr == "SQ" ||
        (unknown && (undefined || by_content || is_listed_as_sequence(element.tag)))) {
      // What is of unknown kind is implicit inside (PS3.5, 6.2.2).
      const Coding inside = element.vr == "UN" ? Coding{false, false} : coding;
      return items(element.value, value_end, inside, undefined, depth);
    }
    return undefined ? fragments(element.value, end, coding) : value_end;
  }

  std::uint64_t items(std::uint64_t at, std::uint64_t end, const Coding& coding, bool delimited,
                      int depth) {
    while (at < end) {
      const std::uint32_t tag = tag_at(at, coding);
      if (tag != kItem && !(delimited && tag == kSequenceEnd))
        throw Flaw{"has a sequence that holds something else than items"};
      const Element item = element_at(at, coding);
      if (item.value > end) throw Flaw{"has a sequence that ends within an item"};
      if (tag == kSequenceEnd) return item.value;
      if (item.length == kUndefined) {
        at = elements(item.value, end, coding, true, depth + 1);
      } else {
        check_end(item, end);
        at = elements(item.value, item.value + item.length, coding, false, depth + 1);
      }
    }
    if (delimited) throw Flaw{"has a sequence without an end"};
    return at;
  }

  // Compressed pixels of a picture within the data set.
  std::uint64_t fragments(std::uint64_t at, std::uint64_t end, const Coding& coding) {
    while (at < end) {
      const Element item = element_at(at, coding);
      if (item.tag == kSequenceEnd) return item.value;
      if (item.tag != kItem) throw Flaw{"has compressed data that is cut off"};
      check_end(item, end);
      at = item.value + item.length;
    }
    throw Flaw{"has compressed data without an end"};
  }

  Window window_;
};

}  // namespace

std::string flaw_of_dicom(const std::filesystem::path& file) {
  try {
    Walker(file).walk();
    return {};
  } catch (const Flaw& flaw) {
    return flaw.what;
  }
}

}  // namespace organbake
