// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "organbake/core/run_context.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

enum class MeshUnit { mm, cm, m, inch };
// Where x, y and z of a file point: to the patient's left, posterior and superior (the world);
// right, anterior and superior; left, superior and anterior (y up, as glTF and many editors have
// it).
enum class MeshSpace { lps, ras, y_up };

struct UnitName {
  MeshUnit unit;
  const char* name;  // as options and headers have it
  double size_mm;
  const char* words;
};
inline constexpr UnitName kMeshUnits[] = {{MeshUnit::mm, "mm", 1, "millimetres"},
                                          {MeshUnit::cm, "cm", 10, "centimetres"},
                                          {MeshUnit::inch, "in", 25.4, "inches"},
                                          {MeshUnit::m, "m", 1000, "metres"}};
struct SpaceName {
  MeshSpace space;
  const char *name, *letters;  // as options have it, and as headers
};
inline constexpr SpaceName kMeshSpaces[] = {{MeshSpace::lps, "LPS", "LPS"},
                                            {MeshSpace::ras, "RAS", "RAS"},
                                            {MeshSpace::y_up, "y-up", "LSA"}};

// What is known of a file's coordinates, by the file itself or by whoever reads it.
struct MeshFrame {
  std::optional<MeshUnit> unit = {};
  std::optional<MeshSpace> space = {};
  bool ours = false;       // written by this project
  bool unit_told = false;  // of what a mesh was read by: whether anybody told its unit
};

double mm_per(MeshUnit unit);
const char* name_of(MeshUnit unit);
const char* in_words(MeshUnit unit);
const char* name_of(MeshSpace space);
// A proper rotation.
Eigen::Matrix3d world_from_axes(MeshSpace space);

// What the beginning of a mesh file says of itself: SPACE=RAS or SPACE=LPS, as 3D Slicer writes it
// into OBJ, PLY, STL and VTK files, UNIT=mm beside it, and the comments of our own PLY, OBJ and
// glTF files. Throws BadDataError for other axes; `name` is put before the message.
MeshFrame frame_in_header(std::string_view header, const std::string& name);

// What most organs are about.
inline constexpr double kTypicalOrgan_mm = 150;
// The unit in which something that is so many units across would be an organ, nearest to the size
// of most, or else one of the small ones; nothing when there is none.
std::optional<MeshUnit> unit_of_organ(double across_units);
// Organs that people bake, up to a whole body. Among those that are smaller (an infant's
// gallbladder is 25 mm long, a lymph node 10 mm) lie all in centimetres, so that a unit must be
// told.
bool organ_sized(double across_mm);
// Those as well, down to a vessel's piece.
bool may_be_organ(double across_mm);
// Whether nothing speaks against a mesh's size, by what it is: an organ's, or, with its unit told,
// a small one's; or that of a part of a surface, of which a tenth or more is cut off, and which may
// be as small whether told or not.
bool plausible_size(const TriangleMesh& mesh_mm, bool unit_told);

// Reads a surface mesh by its name's ending: .ply, .obj, .stl, .off, .vtk (legacy polydata), .vtp,
// .vtu (the outside of its cells), .glb, .gltf. Polygons become triangles; colours become linear
// ones; vertices of open edges that coincide are welded, and their number is told.
// The coordinates become the world's, millimetres and LPS. What the file says of them holds
// (frame_in_header); where it says nothing, `told`; where that does not either, glTF is in metres
// with y up, and all others are in the world's own.
// Closed pieces that are wound inside out are turned (turn_outward), and it is warned of, as of
// sizes that no organ has. Throws NoInputError, UsageError (unknown ending) or BadDataError
// (damaged, no faces, bad index, NaN).
TriangleMesh read_mesh(const std::filesystem::path& path, const MeshFrame& told = {},
                       const RunContext& context = {});
// The same, with the frame that its coordinates were taken in.
TriangleMesh read_mesh(const std::filesystem::path& path, const MeshFrame& told,
                       const RunContext& context, MeshFrame& taken);

}  // namespace organbake
