// SPDX-License-Identifier: GPL-3.0-or-later
// VTK's legacy format ("VTK File Formats", Simple Legacy Formats), ASCII or binary, versions 1.0 to
// 5.1: of polydata the polygons and strips, of unstructured grids the outside, and COLOR_SCALARS
// when they are the first point data; everything else is passed over. By hand, since
// vtkPolyDataReader crashes on truncated files (VTK 9.1); every count is held against the file's
// size before memory is taken.
#include <algorithm>
#include <cmath>
#include <map>

#include "meshes/mesh_readers.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/scalar_type.h"
#include "organbake/core/text.h"

namespace organbake {
namespace {

constexpr std::string_view kSpace = " \t\r\n";

ScalarType type_of(const std::string& name, const std::string& type) {
  static const std::map<std::string, ScalarType> kTypes = {{"unsigned_char", ScalarType::uint8},
                                                           {"char", ScalarType::int8},
                                                           {"signed_char", ScalarType::int8},
                                                           {"unsigned_short", ScalarType::uint16},
                                                           {"short", ScalarType::int16},
                                                           {"unsigned_int", ScalarType::uint32},
                                                           {"int", ScalarType::int32},
                                                           {"vtkidtype", ScalarType::int32},
                                                           {"vtkIdType", ScalarType::int32},
                                                           {"unsigned_long", ScalarType::uint64},
                                                           {"long", ScalarType::int64},
                                                           {"vtktypeint64", ScalarType::int64},
                                                           {"vtktypeuint64", ScalarType::uint64},
                                                           {"float", ScalarType::float32},
                                                           {"double", ScalarType::float64}};
  const auto found = kTypes.find(type);
  if (found == kTypes.end())
    throw BadDataError(name + ": values of type \"" + type + "\" are not read");
  return found->second;
}

// Words and arrays of numbers of a legacy VTK file, one after the other. All members throw
// BadDataError naming the file when it ends too early or holds no number where one must be.
class LegacyVtkScanner {
 public:
  LegacyVtkScanner(std::string_view text, std::string name) : text_(text), name_(std::move(name)) {
    if (!text_.starts_with("# vtk DataFile Version")) fail("is not a legacy VTK file");
    skip_line();
    skip_line();  // the title
    const std::string coding = word();
    if (coding != "ASCII" && coding != "BINARY") fail("is neither ASCII nor BINARY");
    binary_ = coding == "BINARY";
  }

  bool binary() const { return binary_; }

  // The next word; empty at the end of the file.
  std::string word() {
    const std::size_t first = std::min(text_.find_first_not_of(kSpace, at_), text_.size());
    at_ = std::min(text_.find_first_of(kSpace, first), text_.size());
    return std::string(text_.substr(first, at_ - first));
  }

  std::string_view line() {
    const std::size_t begin = at_, end = std::min(text_.find('\n', at_), text_.size());
    at_ = std::min(end + 1, text_.size());
    return text_.substr(begin, end - begin);
  }
  void skip_line() { line(); }
  void skip_to_empty_line() {
    skip_line();  // the rest of this one
    while (at_ < text_.size() && line().find_first_not_of(kSpace) != std::string_view::npos) {
    }
  }

  // A count that the rest of the file can hold when each item takes at least `least_bytes`.
  std::size_t count(std::size_t least_bytes) {
    const std::string text = word();
    const auto value = number_in<std::size_t>(text);
    if (!value) fail("\"" + text.substr(0, 40) + "\" is not a count");
    if (*value > text_.size() / least_bytes + 1)
      fail("truncated: it claims " + text + " items, more than its " +
           std::to_string(text_.size()) + " bytes can hold");
    return *value;
  }

  // `count` numbers of a VTK type name ("float", "int", "vtktypeint64" …), big-endian when binary.
  std::vector<double> numbers(const std::string& type, std::size_t count) {
    if (binary_) return binary_numbers(type, count);
    std::vector<double> values;
    for (std::size_t i = 0; i < count; ++i) {
      const std::string text = word();
      if (text.empty()) fail("truncated: it ends within an array of " + type);
      const auto value = number_in<double>(text);
      if (!value) fail("\"" + text.substr(0, 40) + "\" is not a number");
      values.push_back(*value);
    }
    return values;
  }

  [[noreturn]] void fail(const std::string& message) const {
    throw BadDataError(name_ + ": " + message);
  }

 private:
  std::vector<double> binary_numbers(const std::string& type, std::size_t count) {
    const ScalarType stored = type_of(name_, type);
    const std::size_t width = bytes_of(stored);
    skip_line();  // the values begin behind the line that announces them
    if (count > (text_.size() - at_) / width) fail("truncated: it ends within an array of " + type);
    std::vector<double> values;
    with_scalar_type(stored, [&](auto zero) {
      for (std::size_t i = 0; i < count; ++i, at_ += width)
        values.push_back(static_cast<double>(bytes_as<decltype(zero)>(&text_[at_], true)));
    });
    return values;
  }

  std::string_view text_;
  std::string name_;
  std::size_t at_ = 0;
  bool binary_ = false;
};

// Lists of cells as they are written: where in the corners each ends.
struct WrittenCells {
  std::vector<double> ends, corners;

  VtkCells checked(const VtkSurface& surface, const std::string& name) const {
    return {ends, corners, surface.points.size(), name};
  }
};

void read_points(LegacyVtkScanner& scanner, VtkSurface& surface) {
  const std::size_t count = scanner.count(3);
  const std::string type = scanner.word();
  const std::vector<double> xyz = scanner.numbers(type, 3 * count);
  surface.points.clear();
  for (std::size_t v = 0; v < count; ++v)
    surface.points.emplace_back(xyz[3 * v], xyz[3 * v + 1], xyz[3 * v + 2]);
}

// Up to version 4: every cell is its number of corners and the corners.
WrittenCells split_counted(LegacyVtkScanner& scanner, const std::vector<double>& list,
                           std::size_t cells) {
  WrittenCells out;
  std::size_t at = 0;
  for (std::size_t cell = 0; cell < cells; ++cell) {
    const double corners = at < list.size() ? list[at] : -1;
    if (!(corners >= 0 && corners <= static_cast<double>(list.size() - at - 1)))
      scanner.fail("cell " + std::to_string(cell) + " is longer than the list of cells");
    const auto first = list.begin() + static_cast<std::ptrdiff_t>(at) + 1;
    at += 1 + static_cast<std::size_t>(corners);
    out.corners.insert(out.corners.end(), first, list.begin() + static_cast<std::ptrdiff_t>(at));
    out.ends.push_back(static_cast<double>(out.corners.size()));
  }
  return out;
}

// Since version 5: one array of offsets, of which the first is 0, and one of corners.
WrittenCells read_offset_cells(LegacyVtkScanner& scanner, std::size_t offset_count,
                               std::size_t corner_count) {
  WrittenCells out;
  std::string type = scanner.word();
  out.ends = scanner.numbers(type, offset_count);
  if (scanner.word() != "CONNECTIVITY") scanner.fail("has OFFSETS without CONNECTIVITY");
  type = scanner.word();
  out.corners = scanner.numbers(type, corner_count);
  if (out.ends.empty()) return out;
  if (out.ends.front() != 0) scanner.fail("cell 0 lies outside the list of corners");
  out.ends.erase(out.ends.begin());
  return out;
}

WrittenCells read_cells(LegacyVtkScanner& scanner) {
  const std::size_t cells = scanner.count(1), length = scanner.count(1);
  LegacyVtkScanner ahead = scanner;
  if (ahead.word() != "OFFSETS")
    return split_counted(scanner, scanner.numbers("int", length), cells);
  scanner.word();
  return read_offset_cells(scanner, cells, length);
}

void skip_fields(LegacyVtkScanner& scanner) {
  scanner.word();  // the name of the group
  const std::size_t arrays = scanner.count(1);
  for (std::size_t a = 0; a < arrays; ++a) {
    scanner.word();
    const std::size_t components = scanner.count(1), tuples = scanner.count(1);
    const std::string type = scanner.word();
    if (components > 0 && tuples > std::size_t{1} << 40) scanner.fail("a field is too long");
    scanner.numbers(type, components * tuples);
  }
}

// COLOR_SCALARS: 0…1 as text, 0…255 as bytes.
void read_colors(LegacyVtkScanner& scanner, VtkSurface& surface) {
  const std::size_t points = surface.points.size();
  if (scanner.count(1) != points || scanner.word() != "COLOR_SCALARS") return;
  scanner.word();
  const std::size_t components = scanner.count(1);
  if (components != 3 && components != 4) return;
  const std::vector<double> values = scanner.numbers("unsigned_char", components * points);
  const auto byte = [&](double value) {
    return std::round(std::clamp(scanner.binary() ? value : 255 * value, 0.0, 255.0));
  };
  surface.point_colors.scale = ColorScale::byte;
  for (std::size_t at = 0; at < values.size(); at += components)
    surface.point_colors.written.emplace_back(byte(values[at]), byte(values[at + 1]),
                                              byte(values[at + 2]));
}

}  // namespace

TriangleMesh read_legacy_vtk(const std::filesystem::path& path) {
  const std::string text = read_text_file(path, std::size_t{1} << 36);
  const std::string name = path.string();
  LegacyVtkScanner scanner(text, name);
  const std::string keyword = scanner.word(), kind = scanner.word();
  const bool grid = kind == "UNSTRUCTURED_GRID";
  if (keyword != "DATASET" || !(kind == "POLYDATA" || grid))
    scanner.fail("holds \"" + kind +
                 "\"; a surface (DATASET POLYDATA) or a grid of cells (DATASET "
                 "UNSTRUCTURED_GRID) is needed");
  VtkSurface surface;
  WrittenCells polygons, strips, cells;
  std::vector<double> kinds;
  for (std::string word; !(word = scanner.word()).empty();) {
    if (word == "POINTS") {
      read_points(scanner, surface);
    } else if (word == "POLYGONS" && !grid) {
      polygons = read_cells(scanner);
    } else if (word == "TRIANGLE_STRIPS" && !grid) {
      strips = read_cells(scanner);
    } else if ((word == "VERTICES" || word == "LINES") && !grid) {
      read_cells(scanner);
    } else if (word == "CELLS" && grid) {
      cells = read_cells(scanner);
    } else if (word == "CELL_TYPES" && grid) {
      kinds = scanner.numbers("int", scanner.count(1));
    } else if (word == "FIELD") {
      skip_fields(scanner);
    } else if (word == "METADATA") {
      scanner.skip_to_empty_line();
    } else if (word == "POINT_DATA") {
      read_colors(scanner, surface);
      break;  // attributes come last
    } else if (word == "CELL_DATA") {
      break;
    } else {
      scanner.fail("\"" + word.substr(0, 40) + "\" is not a part of " +
                   (grid ? "an unstructured grid" : "polydata"));
    }
  }
  if (!grid)
    return triangles_of(surface, polygons.checked(surface, name), strips.checked(surface, name), 0,
                        name);
  if (kinds.size() != cells.ends.size())
    scanner.fail("truncated: it holds " + std::to_string(cells.ends.size()) + " cells and " +
                 std::to_string(kinds.size()) + " of their types");
  return outside_of(surface, cells.checked(surface, name), kinds, name);
}

}  // namespace organbake
