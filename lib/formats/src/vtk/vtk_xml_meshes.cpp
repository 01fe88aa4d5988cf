// SPDX-License-Identifier: GPL-3.0-or-later
#include "vtk/vtk_xml_meshes.h"

#include <vtkCell.h>
#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkCellType.h>
#include <vtkDataSetSurfaceFilter.h>
#include <vtkDoubleArray.h>
#include <vtkGenericCell.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>
#include <vtkUnsignedCharArray.h>
#include <vtkUnsignedShortArray.h>
#include <vtkUnstructuredGrid.h>

#include <cstdint>

#include "meshes/polydata_mesh.h"
#include "organbake/formats/vtk_error_log.h"
#include "organbake/formats/vtk_xml.h"

namespace organbake {
namespace {

const VtkXmlPiece::Section& section_of(const VtkXmlPiece& piece, const char* name) {
  static const VtkXmlPiece::Section none;
  const auto found = piece.sections.find(name);
  return found == piece.sections.end() ? none : found->second;
}

const VtkXmlArray& needed(const VtkXmlFile& file, const VtkXmlPiece& piece, const char* section,
                          const char* name) {
  const VtkXmlArray* array = section_of(piece, section).find(name);
  if (!array) file.fail(std::string("its ") + section + " lack the array \"" + name + "\"");
  return *array;
}

vtkSmartPointer<vtkPoints> points_of(const VtkXmlFile& file, const VtkXmlPiece& piece) {
  const auto& arrays = section_of(piece, "Points").arrays;
  if (arrays.empty() || arrays[0].components != 3) file.fail("holds no points in space");
  const std::size_t count = file.count(piece.attributes, "NumberOfPoints");
  const std::vector<double> places = file.numbers(arrays[0], std::nullopt).as_doubles();
  if (places.size() / 3 != count || places.size() % 3 != 0)
    file.fail("truncated: it holds " + std::to_string(places.size() / 3) + " points, " +
              std::to_string(count) + " are wanted");
  const auto points = vtkSmartPointer<vtkPoints>::New();
  points->SetDataTypeToDouble();
  for (std::size_t p = 0; p < count; ++p) points->InsertNextPoint(&places[3 * p]);
  return points;
}

// The corners of each cell: a list of points, and where in it each cell ends.
struct Cells {
  std::vector<std::vector<vtkIdType>> corners;
};

Cells cells_of(const VtkXmlFile& file, const VtkXmlPiece& piece, const char* section,
               std::size_t count, vtkIdType points) {
  Cells cells;
  if (count == 0) return cells;
  const std::vector<double> ends =
      file.numbers(needed(file, piece, section, "offsets"), std::nullopt).as_doubles();
  const std::vector<double> list =
      file.numbers(needed(file, piece, section, "connectivity"), std::nullopt).as_doubles();
  if (ends.size() != count)
    file.fail("truncated: it holds " + std::to_string(ends.size()) + " cells, " +
              std::to_string(count) + " are wanted");
  double begin = 0;
  for (std::size_t cell = 0; cell < count; begin = ends[cell++]) {
    if (!(ends[cell] >= begin && ends[cell] <= static_cast<double>(list.size())))
      file.fail("cell " + std::to_string(cell) + " ends outside the list of its points");
    auto& corners = cells.corners.emplace_back();
    for (auto at = static_cast<std::size_t>(begin); at < static_cast<std::size_t>(ends[cell]);
         ++at) {
      if (!(list[at] >= 0 && list[at] < static_cast<double>(points)))
        file.fail("cell " + std::to_string(cell) + " uses point " +
                  std::to_string(static_cast<long double>(list[at])) + " of " +
                  std::to_string(points));
      corners.push_back(static_cast<vtkIdType>(list[at]));
    }
  }
  return cells;
}

vtkSmartPointer<vtkDataArray> empty_array(ScalarType type) {
  if (type == ScalarType::uint8) return vtkSmartPointer<vtkUnsignedCharArray>::New();
  if (type == ScalarType::uint16) return vtkSmartPointer<vtkUnsignedShortArray>::New();
  return vtkSmartPointer<vtkDoubleArray>::New();
}

// The arrays that may be colours.
void add_colors(const VtkXmlFile& file, const VtkXmlPiece& piece, const char* section,
                std::size_t tuples, vtkDataSetAttributes* data) {
  const VtkXmlPiece::Section& from = section_of(piece, section);
  for (const VtkXmlArray& array : from.arrays) {
    if (array.components != 3 && array.components != 4) continue;
    const VtkXmlNumbers numbers =
        file.numbers(array, tuples * static_cast<std::size_t>(array.components));
    const std::vector<double> values = numbers.as_doubles();
    const auto to = empty_array(numbers.type);
    to->SetName(array.name.c_str());
    to->SetNumberOfComponents(array.components);
    to->SetNumberOfTuples(static_cast<vtkIdType>(tuples));
    for (std::size_t i = 0; i < values.size(); ++i)
      to->SetComponent(static_cast<vtkIdType>(i / to->GetNumberOfComponents()),
                       static_cast<int>(i % to->GetNumberOfComponents()), values[i]);
    data->AddArray(to);
  }
  const auto active = from.attributes.find("Scalars");
  if (active != from.attributes.end()) data->SetActiveScalars(active->second.c_str());
}

vtkSmartPointer<vtkCellArray> cell_array(const Cells& cells) {
  const auto array = vtkSmartPointer<vtkCellArray>::New();
  for (const auto& corners : cells.corners)
    array->InsertNextCell(static_cast<vtkIdType>(corners.size()), corners.data());
  return array;
}

TriangleMesh polydata_piece(const VtkXmlFile& file, const VtkXmlPiece& piece,
                            const std::string& name) {
  vtkNew<vtkPolyData> polydata;
  const auto points = points_of(file, piece);
  polydata->SetPoints(points);
  std::size_t all_cells = 0;
  const auto cells = [&](const char* section, const char* count) {
    const std::size_t number = file.count(piece.attributes, count);
    all_cells += number;
    return cell_array(cells_of(file, piece, section, number, points->GetNumberOfPoints()));
  };
  polydata->SetVerts(cells("Verts", "NumberOfVerts"));
  polydata->SetLines(cells("Lines", "NumberOfLines"));
  polydata->SetPolys(cells("Polys", "NumberOfPolys"));
  polydata->SetStrips(cells("Strips", "NumberOfStrips"));
  add_colors(file, piece, "PointData", static_cast<std::size_t>(points->GetNumberOfPoints()),
             polydata->GetPointData());
  add_colors(file, piece, "CellData", all_cells, polydata->GetCellData());
  return mesh_from_polydata(polydata, name);
}

// VTK's filters trust a cell to have the corners that its kind has. Returns the kind.
int checked_kind(const VtkXmlFile& file, std::size_t cell, double written, std::size_t corners) {
  constexpr double kKinds = static_cast<int>(VTK_NUMBER_OF_CELL_TYPES);
  const int kind = written >= 0 && written < kKinds ? static_cast<int>(written) : -1;
  const std::string what = "cell " + std::to_string(cell) + " is of kind " + std::to_string(kind);
  if (kind == VTK_POLYHEDRON)
    file.fail("holds polyhedra; save its surface (ParaView: Extract Surface)");
  const auto example = kind >= VTK_VERTEX && kind <= VTK_BIQUADRATIC_TRIANGLE
                           ? vtkSmartPointer<vtkCell>::Take(vtkGenericCell::InstantiateCell(kind))
                           : nullptr;
  if (!example)
    file.fail(what + ", which is not read; save its surface (ParaView: Extract Surface)");
  const auto needs = static_cast<std::size_t>(example->GetNumberOfPoints());  // 0: any number
  if (corners == 0 || (needs > 0 && corners != needs))
    file.fail(what + " and has " + std::to_string(corners) + " corners");
  return kind;
}

TriangleMesh grid_piece(const VtkXmlFile& file, const VtkXmlPiece& piece, const std::string& name) {
  vtkNew<vtkUnstructuredGrid> grid;
  const auto points = points_of(file, piece);
  grid->SetPoints(points);
  const std::size_t count = file.count(piece.attributes, "NumberOfCells");
  const Cells cells = cells_of(file, piece, "Cells", count, points->GetNumberOfPoints());
  const std::vector<double> kinds =
      count == 0 ? std::vector<double>()
                 : file.numbers(needed(file, piece, "Cells", "types"), count).as_doubles();
  for (std::size_t cell = 0; cell < count; ++cell) {
    const auto& corners = cells.corners[cell];
    grid->InsertNextCell(checked_kind(file, cell, kinds[cell], corners.size()),
                         static_cast<vtkIdType>(corners.size()), corners.data());
  }
  add_colors(file, piece, "PointData", static_cast<std::size_t>(points->GetNumberOfPoints()),
             grid->GetPointData());
  add_colors(file, piece, "CellData", count, grid->GetCellData());
  vtkNew<vtkDataSetSurfaceFilter> surface;
  VtkErrorLog errors;
  errors.watch(surface);
  surface->SetInputData(grid);
  surface->Update();
  errors.throw_if_any(name);
  return mesh_from_polydata(surface->GetOutput(), name);
}

// Pieces share no points, so each is a mesh of its own. 3D Slicer names the axes in a field.
template <class ReadPiece>
WrittenMesh joined_pieces(const VtkXmlFile& file, const std::string& name,
                          const ReadPiece& read_piece) {
  WrittenMesh written{{}, frame_in_header("SPACE=" + file.field_text("SPACE"), name)};
  TriangleMesh& all = written.mesh;
  bool colored = true;
  for (const VtkXmlPiece& piece : file.pieces()) {
    const TriangleMesh one = read_piece(file, piece, name);
    const auto before = static_cast<std::uint32_t>(all.vertices.size());
    all.vertices.insert(all.vertices.end(), one.vertices.begin(), one.vertices.end());
    all.colors.insert(all.colors.end(), one.colors.begin(), one.colors.end());
    colored = colored && !one.colors.empty();
    for (const Face& face : one.faces)
      all.faces.push_back({face[0] + before, face[1] + before, face[2] + before});
  }
  if (!colored) all.colors.clear();
  return written;
}

}  // namespace

WrittenMesh read_vtp(const std::filesystem::path& path) {
  return joined_pieces(VtkXmlFile(path, "PolyData"), path.string(), polydata_piece);
}

WrittenMesh read_vtu(const std::filesystem::path& path) {
  return joined_pieces(VtkXmlFile(path, "UnstructuredGrid"), path.string(), grid_piece);
}

}  // namespace organbake
