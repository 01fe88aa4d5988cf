// SPDX-License-Identifier: GPL-3.0-or-later
// Surfaces of VTK's XML files (vtk_xml.h): the polygons and strips of PolyData, the outside of an
// UnstructuredGrid's cells, with the colours of their points or cells.
#include <cstdint>

#include "meshes/mesh_readers.h"
#include "organbake/core/text.h"
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

std::vector<Eigen::Vector3d> points_of(const VtkXmlFile& file, const VtkXmlPiece& piece) {
  const auto& arrays = section_of(piece, "Points").arrays;
  if (arrays.empty() || arrays[0].components != 3) file.fail("holds no points in space");
  const std::size_t count = file.count(piece.attributes, "NumberOfPoints");
  const std::vector<double> places = file.numbers(arrays[0], std::nullopt).as_doubles();
  if (places.size() / 3 != count || places.size() % 3 != 0)
    file.fail("truncated: it holds " + std::to_string(places.size() / 3) + " points, " +
              std::to_string(count) + " are wanted");
  std::vector<Eigen::Vector3d> points;
  for (std::size_t p = 0; p < count; ++p)
    points.emplace_back(places[3 * p], places[3 * p + 1], places[3 * p + 2]);
  return points;
}

VtkCells cells_of(const VtkXmlFile& file, const VtkXmlPiece& piece, const char* section,
                  std::size_t count, std::size_t points, const std::string& name) {
  if (count == 0) return {};
  const std::vector<double> ends =
      file.numbers(needed(file, piece, section, "offsets"), std::nullopt).as_doubles();
  const std::vector<double> list =
      file.numbers(needed(file, piece, section, "connectivity"), std::nullopt).as_doubles();
  if (ends.size() != count)
    file.fail("truncated: it holds " + std::to_string(ends.size()) + " cells, " +
              std::to_string(count) + " are wanted");
  return {ends, list, points, name};
}

bool named_as_colors(const std::string& written) {
  const std::string name = lower_case(written);
  return name.find("color") != name.npos || name.find("colour") != name.npos ||
         name.starts_with("rgb");
}

// The active array when it holds bytes; else the first that is named as colours are.
VtkColors colors_of(const VtkXmlFile& file, const VtkXmlPiece& piece, const char* section,
                    std::size_t tuples) {
  const VtkXmlPiece::Section& from = section_of(piece, section);
  const auto active = from.attributes.find("Scalars");
  const VtkXmlArray* chosen = nullptr;
  for (const VtkXmlArray& array : from.arrays) {
    if (array.components != 3 && array.components != 4) continue;
    const auto type = array.attributes.find("type");
    const bool bytes = type != array.attributes.end() && type->second == "UInt8";
    if (bytes && active != from.attributes.end() && active->second == array.name) {
      chosen = &array;
      break;
    }
    if (!chosen && named_as_colors(array.name)) chosen = &array;
  }
  if (!chosen) return {};
  const auto components = static_cast<std::size_t>(chosen->components);
  const VtkXmlNumbers numbers = file.numbers(*chosen, tuples * components);
  const std::vector<double> values = numbers.as_doubles();
  VtkColors colors{{},
                   numbers.type == ScalarType::uint8    ? ColorScale::byte
                   : numbers.type == ScalarType::uint16 ? ColorScale::two_bytes
                                                        : ColorScale::number};
  for (std::size_t at = 0; at < values.size(); at += components)
    colors.written.emplace_back(values[at], values[at + 1], values[at + 2]);
  return colors;
}

VtkSurface surface_of(const VtkXmlFile& file, const VtkXmlPiece& piece, std::size_t cells) {
  VtkSurface surface{points_of(file, piece), {}, {}};
  surface.point_colors = colors_of(file, piece, "PointData", surface.points.size());
  surface.cell_colors = colors_of(file, piece, "CellData", cells);
  return surface;
}

TriangleMesh polydata_piece(const VtkXmlFile& file, const VtkXmlPiece& piece,
                            const std::string& name) {
  const auto number = [&](const char* of) { return file.count(piece.attributes, of); };
  const std::size_t before = number("NumberOfVerts") + number("NumberOfLines"),
                    polygons = number("NumberOfPolys"), strips = number("NumberOfStrips");
  const VtkSurface surface = surface_of(file, piece, before + polygons + strips);
  const auto cells = [&](const char* section, std::size_t count) {
    return cells_of(file, piece, section, count, surface.points.size(), name);
  };
  return triangles_of(surface, cells("Polys", polygons), cells("Strips", strips), before, name);
}

TriangleMesh grid_piece(const VtkXmlFile& file, const VtkXmlPiece& piece, const std::string& name) {
  const std::size_t count = file.count(piece.attributes, "NumberOfCells");
  const VtkSurface surface = surface_of(file, piece, count);
  const VtkCells cells = cells_of(file, piece, "Cells", count, surface.points.size(), name);
  const std::vector<double> kinds =
      count == 0 ? std::vector<double>()
                 : file.numbers(needed(file, piece, "Cells", "types"), count).as_doubles();
  return outside_of(surface, cells, kinds, name);
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
