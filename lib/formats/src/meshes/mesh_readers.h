// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "organbake/bundle/json_fields.h"
#include "organbake/core/run_context.h"
#include "organbake/core/scalar_type.h"
#include "organbake/formats/mesh_files.h"
#include "organbake/geometry/polygon.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// Meshes in double precision, as VTK's readers do not give them. Polygons are cut into triangles;
// coordinates are as written; all throw BadDataError with the file's name and, for text, the line.

// Wavefront OBJ: v (with colours behind the place: sRGB, 0…1 or 0…255) and f; indices of textures
// and normals are not asked, so that their seams do not part the surface. Negative indices count
// from the end; lines that continue after a backslash are joined.
TriangleMesh parse_obj(std::string_view text, const std::string& name);

// OFF, COFF, NOFF, STOFF and their mixtures, as text. Colours of vertices are read.
TriangleMesh parse_off(std::string_view text, const std::string& name);

// STL, binary or text in any letters. Every triangle has corners of its own. A binary one may have
// bytes behind its triangles.
TriangleMesh parse_stl(std::string_view bytes, const std::string& name);

// VTK's legacy format, ASCII or binary, versions 1.0 to 5.1 (legacy_vtk.cpp): polydata, and the
// outside of unstructured grids.
TriangleMesh read_legacy_vtk(const std::filesystem::path& path);

enum class MeshFormat { ply, stl, obj, off, legacy_vtk, vtk_polydata, vtk_grid, gltf };

// The numbers of a file as they are written, and what it says of them.
struct WrittenMesh {
  TriangleMesh mesh;
  MeshFrame frame;
};

// The polygons and strips of a .vtp file, and the outside of a .vtu file's cells: of solids their
// surface, of faces themselves.
WrittenMesh read_vtp(const std::filesystem::path& path);
WrittenMesh read_vtu(const std::filesystem::path& path);

// The triangles of a glTF 2.0 file (.glb, or .gltf with its buffers inside or beside it), in metres
// and on its own axes: every mesh of the scene where its nodes, its skin's joints and its morph
// weights put it; strips and fans become
// triangles, points and lines are passed over, COLOR_0 is linear by glTF's definition. What would
// change the shape and is not followed is warned of: animations, and extensions that are not known.
// Throws NoInputError (a buffer's file that is missing), or BadDataError, also for an extension
// that the file requires and that is not known, or packs the numbers away (Draco, meshopt).
TriangleMesh read_gltf(const std::filesystem::path& path, const RunContext& context = {});

// The corners of each cell of a VTK data set.
class VtkCells {
 public:
  VtkCells() = default;
  // `ends`: where in the list of `corners` each cell ends. Throws BadDataError with `name` for an
  // end outside the list and for a corner that is none of `points`.
  VtkCells(const std::vector<double>& ends, const std::vector<double>& corners, std::size_t points,
           const std::string& name);

  std::size_t size() const { return ends_.size(); }
  std::span<const std::uint32_t> operator[](std::size_t cell) const {
    const std::size_t begin = cell == 0 ? 0 : ends_[cell - 1];
    return std::span(corners_).subspan(begin, ends_[cell] - begin);
  }

 private:
  std::vector<std::uint32_t> corners_;
  std::vector<std::size_t> ends_;
};

// Colours as a file has them, of its points or its cells; empty: there are none.
struct VtkColors {
  std::vector<Eigen::Vector3d> written;
  ColorScale scale = ColorScale::number;
};

// What a data set of VTK holds of a surface.
struct VtkSurface {
  std::vector<Eigen::Vector3d> points;
  VtkColors point_colors, cell_colors;  // those of points go before
};

// The triangles of polygons and strips. The colours of cells begin with those of
// `cells_before` that are no faces.
TriangleMesh triangles_of(const VtkSurface& surface, const VtkCells& polygons,
                          const VtkCells& strips, std::size_t cells_before,
                          const std::string& name);

// The outside of an unstructured grid: of solid cells the faces that one of them alone has, and all
// flat cells that are no faces of solids; points inside go. `kinds` are VTK's numbers. Curved cells
// are cut through the middles of their edges. Throws BadDataError with `name` for a kind that is
// not read (polyhedra, cells of higher order) and for a cell that has not its kind's corners.
TriangleMesh outside_of(const VtkSurface& surface, const VtkCells& cells,
                        const std::vector<double>& kinds, const std::string& name);

// The numbers of a glTF accessor, item by item.
struct GltfNumbers {
  std::size_t items = 0, components = 1;
  std::vector<double> values;  // normalised ones are in −1…1 already
  bool written = true;         // false: zeros, of which the file holds none
};

// A glTF document with its buffers: in the .glb, in the text itself, or in files beside it. All
// members throw BadDataError that names the file and what in it is wrong.
class GltfDocument {
 public:
  explicit GltfDocument(const std::filesystem::path& path);

  JsonField root() const { return {json_, path_.string()}; }
  // Of accessor `index`, which may hold no more than its buffer does.
  GltfNumbers numbers(std::size_t index) const;
  // Bytes of the file and its buffers together.
  std::size_t total_bytes() const { return total_bytes_; }

 private:
  void open(const std::string& bytes);
  void read_buffers();
  std::string buffer_from(const std::string& uri, const JsonField& field) const;
  // `items` of `bytes_each`, `stride` apart, from an offset within a view.
  void read_view(const JsonField& at, std::size_t items, ScalarType type, bool normalized,
                 std::size_t components, std::vector<double>& values) const;

  std::filesystem::path path_;
  Json json_;
  std::string binary_;  // the .glb's own buffer
  std::vector<std::string> buffers_;
  std::size_t total_bytes_ = 0;
};

}  // namespace organbake

// The door of the module organbake_meshes, which reads VTK's formats and glTF. Of those but VTK's
// XML the frame stays as it is.
extern "C" __attribute__((visibility("default"))) void organbake_meshes(
    organbake::MeshFormat format, const std::filesystem::path& path,
    const organbake::RunContext& context, organbake::WrittenMesh& read);
