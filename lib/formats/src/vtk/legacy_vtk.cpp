// SPDX-License-Identifier: GPL-3.0-or-later
#include "vtk/legacy_vtk.h"

#include <vtkCellArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <cmath>

#include "meshes/polydata_mesh.h"
#include "organbake/core/files.h"
#include "vtk/legacy_vtk_scanner.h"

namespace organbake {
namespace {

void read_points(LegacyVtkScanner& scanner, vtkPolyData& polydata) {
  const std::size_t count = scanner.count(3);
  const std::string type = scanner.word();
  const std::vector<double> xyz = scanner.numbers(type, 3 * count);
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  points->SetNumberOfPoints(static_cast<vtkIdType>(count));
  for (std::size_t v = 0; v < count; ++v) {
    points->SetPoint(static_cast<vtkIdType>(v), &xyz[3 * v]);
  }
  polydata.SetPoints(points);
}

// An index as VTK takes it; −1, which is refused with the others that name no point, if it is none.
vtkIdType index_of(double value) {
  constexpr double kLargest = 4294967295.0;
  const bool whole = value >= 0 && value <= kLargest && value == std::floor(value);
  return whole ? static_cast<vtkIdType>(value) : -1;
}

void append_cell(vtkCellArray& cells, const double* first, std::size_t count) {
  cells.InsertNextCell(static_cast<int>(count));
  for (std::size_t c = 0; c < count; ++c) cells.InsertCellPoint(index_of(first[c]));
}

// Up to version 4: every cell is its number of corners and the corners.
void split_counted(LegacyVtkScanner& scanner, const std::vector<double>& list, std::size_t cells,
                   vtkCellArray& out) {
  std::size_t at = 0;
  for (std::size_t cell = 0; cell < cells; ++cell) {
    const double corners = at < list.size() ? list[at] : -1;
    if (!(corners >= 0 && corners <= static_cast<double>(list.size() - at - 1))) {
      scanner.fail("cell " + std::to_string(cell) + " is longer than the list of cells");
    }
    append_cell(out, list.data() + at + 1, static_cast<std::size_t>(corners));
    at += 1 + static_cast<std::size_t>(corners);
  }
}

// Since version 5: one array of offsets and one of corners.
void read_offset_cells(LegacyVtkScanner& scanner, std::size_t offset_count,
                       std::size_t corner_count, vtkCellArray& out) {
  std::string type = scanner.word();
  const std::vector<double> offsets = scanner.numbers(type, offset_count);
  if (scanner.word() != "CONNECTIVITY") scanner.fail("has OFFSETS without CONNECTIVITY");
  type = scanner.word();
  const std::vector<double> corners = scanner.numbers(type, corner_count);
  for (std::size_t cell = 0; cell + 1 < offsets.size(); ++cell) {
    const double first = offsets[cell], end = offsets[cell + 1];
    if (!(first >= 0 && first <= end && end <= static_cast<double>(corner_count))) {
      scanner.fail("cell " + std::to_string(cell) + " lies outside the list of corners");
    }
    append_cell(out, corners.data() + static_cast<std::size_t>(first),
                static_cast<std::size_t>(end - first));
  }
}

void read_cells(LegacyVtkScanner& scanner, vtkCellArray& out) {
  const std::size_t cells = scanner.count(1), length = scanner.count(1);
  LegacyVtkScanner ahead = scanner;
  if (ahead.word() == "OFFSETS") {
    scanner.word();
    read_offset_cells(scanner, cells, length, out);
  } else {
    split_counted(scanner, scanner.numbers("int", length), cells, out);
  }
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
void read_colors(LegacyVtkScanner& scanner, vtkPolyData& polydata) {
  const auto points = static_cast<std::size_t>(polydata.GetNumberOfPoints());
  if (scanner.count(1) != points || scanner.word() != "COLOR_SCALARS") return;
  scanner.word();
  const std::size_t components = scanner.count(1);
  if (components != 3 && components != 4) return;
  const std::vector<double> values = scanner.numbers("unsigned_char", components * points);
  vtkNew<vtkUnsignedCharArray> colors;
  colors->SetNumberOfComponents(static_cast<int>(components));
  colors->SetNumberOfTuples(static_cast<vtkIdType>(points));
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double byte = scanner.binary() ? values[i] : 255 * values[i];
    colors->SetValue(static_cast<vtkIdType>(i),
                     static_cast<unsigned char>(std::lround(std::clamp(byte, 0.0, 255.0))));
  }
  polydata.GetPointData()->SetScalars(colors);
}

TriangleMesh parse_legacy_vtk(std::span<const std::byte> bytes, const std::string& name) {
  LegacyVtkScanner scanner(bytes, name);
  const std::string keyword = scanner.word(), kind = scanner.word();
  if (keyword != "DATASET" || kind != "POLYDATA") {
    scanner.fail("holds \"" + (kind + "\"; a surface (DATASET POLYDATA) is needed"));
  }
  vtkNew<vtkPolyData> polydata;
  vtkNew<vtkCellArray> polygons, strips, unused;
  for (std::string word; !(word = scanner.word()).empty();) {
    if (word == "POINTS") {
      read_points(scanner, *polydata);
    } else if (word == "POLYGONS") {
      read_cells(scanner, *polygons);
    } else if (word == "TRIANGLE_STRIPS") {
      read_cells(scanner, *strips);
    } else if (word == "VERTICES" || word == "LINES") {
      read_cells(scanner, *unused);
    } else if (word == "FIELD") {
      skip_fields(scanner);
    } else if (word == "METADATA") {
      scanner.skip_to_empty_line();
    } else if (word == "POINT_DATA") {
      read_colors(scanner, *polydata);
      break;  // attributes come last
    } else if (word == "CELL_DATA") {
      break;
    } else {
      scanner.fail("\"" + word.substr(0, 40) + "\" is not a part of polydata");
    }
  }
  polydata->SetPolys(polygons);
  polydata->SetStrips(strips);
  return mesh_from_polydata(polydata, name);
}

}  // namespace

TriangleMesh read_legacy_vtk(const std::filesystem::path& path) {
  return parse_legacy_vtk(read_file(path), path.string());
}

}  // namespace organbake
