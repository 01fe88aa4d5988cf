// SPDX-License-Identifier: GPL-3.0-or-later
#include "formats/mesh_files.h"

#include <vtkCellArray.h>
#include <vtkNew.h>
#include <vtkOBJReader.h>
#include <vtkPolyData.h>
#include <vtkSTLReader.h>
#include <vtkXMLPolyDataReader.h>

#include <algorithm>
#include <fstream>
#include <string>

#include "core/error.h"
#include "formats/legacy_vtk.h"
#include "formats/polydata_mesh.h"
#include "formats/vtk_error_log.h"
#include "geometry/mesh_checks.h"
#include "geometry/ply.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

void check_readable(const fs::path& path) {
  if (!fs::exists(path)) throw NoInputError(path, "does not exist");
  if (!fs::is_regular_file(path)) throw NoInputError(path, "is not a file");
  if (!std::ifstream(path)) throw NoInputError(path, "cannot be opened");
  if (fs::file_size(path) == 0) throw BadDataError(path, "is empty");
}

template <typename Reader>
TriangleMesh read_through(Reader* reader, const fs::path& path) {
  VtkErrorLog errors;
  errors.watch(reader);
  reader->SetFileName(path.c_str());
  reader->Update();
  errors.throw_if_any(path);
  return mesh_from_polydata(reader->GetOutput(), path.string());
}

// A truncated binary STL gives VTK's reader a short but valid-looking mesh, without an error.
void check_stl_size(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::array<unsigned char, 84> header{};
  file.read(reinterpret_cast<char*>(header.data()), header.size());
  const std::string_view first(reinterpret_cast<const char*>(header.data()), 5);
  const auto bytes = static_cast<std::uint64_t>(fs::file_size(path));
  const std::uint64_t faces = header[80] | header[81] << 8 | header[82] << 16 |
                              static_cast<std::uint64_t>(header[83]) << 24;
  const bool binary = bytes == 84 + 50 * faces;
  if (!binary && first != "solid") {
    throw BadDataError(path, "claims " + std::to_string(faces) + " triangles but holds " +
                                 std::to_string(bytes) + " bytes: truncated or not an STL");
  }
}

TriangleMesh read_stl(const fs::path& path) {
  check_stl_size(path);
  vtkNew<vtkSTLReader> reader;
  reader->MergingOn();
  return read_through(reader.Get(), path);
}

TriangleMesh read_vtp(const fs::path& path) {
  vtkNew<vtkXMLPolyDataReader> reader;
  VtkErrorLog parser_errors;
  reader->SetParserErrorObserver(parser_errors.observer());
  TriangleMesh mesh = read_through(reader.Get(), path);
  parser_errors.throw_if_any(path);
  return mesh;
}

TriangleMesh read_by_ending(const fs::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return c >= 'A' && c <= 'Z' ? c + ('a' - 'A') : c; });
  if (ending == ".ply") return read_ply(path);
  if (ending == ".stl") return read_stl(path);
  if (ending == ".obj") return read_through(vtkNew<vtkOBJReader>().Get(), path);
  if (ending == ".vtk") return read_legacy_vtk(path);
  if (ending == ".vtp") return read_vtp(path);
  throw UsageError(path.string() + ": unknown mesh ending \"" + ending +
                   "\"; use .ply, .obj, .stl, .vtk or .vtp");
}

}  // namespace

TriangleMesh read_mesh(const fs::path& path) {
  check_readable(path);
  TriangleMesh mesh = read_by_ending(path);
  check_mesh(mesh, path.string());
  if (mesh.empty()) throw BadDataError(path, "holds no triangles");
  return mesh;
}

}  // namespace organbake
