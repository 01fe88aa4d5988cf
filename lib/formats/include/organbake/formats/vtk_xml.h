// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "organbake/core/scalar_type.h"

namespace organbake {

// The numbers of one DataArray.
struct VtkXmlNumbers {
  ScalarType type = ScalarType::float64;
  std::size_t count = 0;         // numbers, of all components together
  std::vector<std::byte> bytes;  // in the machine's byte order

  std::vector<double> as_doubles() const;
};

using XmlAttributes = std::map<std::string, std::string>;

// A DataArray, its numbers not looked at yet.
struct VtkXmlArray {
  std::string name;
  int components = 1;
  XmlAttributes attributes;
  std::string text;  // between its tags
};

// A part of the data set: its sections ("Points", "Polys", "PointData" …).
struct VtkXmlPiece {
  struct Section {
    XmlAttributes attributes;
    std::vector<VtkXmlArray> arrays;
    const VtkXmlArray* find(std::string_view name) const;
  };
  XmlAttributes attributes;
  std::map<std::string, Section> sections;
};

// A VTK XML file (.vtp, .vtu, .vti), version 0.1 to 2.x: arrays as text, as base64 or appended,
// plain or packed by zlib. Not through VTK's readers, which take memory for whatever a header says
// and trust the numbers in it. All members throw BadDataError naming the file.
class VtkXmlFile {
 public:
  // `kind` is what the file must hold: "PolyData", "UnstructuredGrid", "ImageData".
  VtkXmlFile(const std::filesystem::path& path, const std::string& kind);

  const XmlAttributes& attributes() const { return data_set_; }
  const std::vector<VtkXmlPiece>& pieces() const { return pieces_; }
  // The text that a field of the whole data set holds; empty when there is none of that name.
  std::string field_text(std::string_view name) const;
  // Of exactly so many, or of as many as there are: which is never more than the file can hold.
  VtkXmlNumbers numbers(const VtkXmlArray& array, std::optional<std::size_t> count) const;
  // An attribute that is a count.
  std::size_t count(const XmlAttributes& attributes, const std::string& name) const;
  [[noreturn]] void fail(const std::string& message) const;

 private:
  friend class VtkXmlParser;

  std::filesystem::path path_;
  XmlAttributes file_, data_set_, appended_;
  std::vector<VtkXmlPiece> pieces_;
  VtkXmlPiece::Section fields_;  // of the whole data set
  std::string bytes_;            // of the file
  std::size_t appended_at_ = 0;  // of what follows the '_', 0: there is nothing appended
};

}  // namespace organbake
