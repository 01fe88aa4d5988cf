// SPDX-License-Identifier: GPL-3.0-or-later
#include "formats/mesh_files.h"

#include <cmath>
#include <fstream>
#include <string>

#include "core/error.h"
#include "core/files.h"
#include "core/text.h"
#include "formats/mesh_readers.h"
#include "geometry/mesh_checks.h"
#include "geometry/ply.h"
#include "geometry/weld.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

void check_readable(const fs::path& path) {
  if (!fs::exists(path)) throw NoInputError(path, "does not exist");
  if (!fs::is_regular_file(path)) throw NoInputError(path, "is not a file");
  if (!std::ifstream(path)) throw NoInputError(path, "cannot be opened");
  if (fs::file_size(path) == 0) throw BadDataError(path, "is empty");
}

template <typename Parse>
TriangleMesh parsed(const fs::path& path, const Parse& parse) {
  return parse(read_text_file(path), path.string());
}

bool is_gltf(const std::string& ending) { return ending == ".glb" || ending == ".gltf"; }

TriangleMesh read_by_ending(const fs::path& path) {
  const std::string ending = lower_ending(path);
  if (ending == ".ply") return read_ply(path);
  if (ending == ".stl") return parsed(path, parse_stl);
  if (ending == ".obj") return parsed(path, parse_obj);
  if (ending == ".off") return parsed(path, parse_off);
  if (ending == ".vtk") return read_legacy_vtk(path);
  if (ending == ".vtp") return read_vtp(path);
  if (ending == ".vtu") return read_vtu(path);
  if (is_gltf(ending)) return read_gltf(path);
  throw UsageError(path.string() + ": unknown mesh ending \"" + ending +
                   "\"; use .ply, .obj, .stl, .off, .vtk, .vtp, .vtu, .glb or .gltf");
}

// Our own PLY names its unit in its third line.
bool says_mm(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string line;
  for (int i = 0; i < 3; ++i) std::getline(file, line);
  return line == "comment millimetres, LPS";
}

struct UnitName {
  MeshUnit unit;
  const char* name;
  double size_mm;
};
constexpr UnitName kUnits[] = {{MeshUnit::mm, "mm", 1},
                               {MeshUnit::cm, "cm", 10},
                               {MeshUnit::inch, "in", 25.4},
                               {MeshUnit::m, "m", 1000}};

// Organs, from a vessel's piece to a whole body, are as large as this.
constexpr double kSmallest_mm = 5, kLargest_mm = 2000;
// What most organs are about; a proposed unit is the one that comes nearest.
constexpr double kTypical_mm = 150;

std::string in_words(double mm) {
  return mm >= 1000 ? to_text(mm / 1000, 3) + " m" : to_text(mm, 3) + " mm";
}

bool organ_sized(double across_mm) { return across_mm >= kSmallest_mm && across_mm <= kLargest_mm; }

double across(const TriangleMesh& mesh) { return (bounds(mesh).max - bounds(mesh).min).maxCoeff(); }

// In which something of that many units is an organ, nearest to the size of most; or null.
const UnitName* fitting_unit(double across_units) {
  const UnitName* best = nullptr;
  for (const UnitName& unit : kUnits) {
    if (!organ_sized(across_units * unit.size_mm)) continue;
    const auto off = [&](const UnitName& u) {
      return std::abs(std::log(across_units * u.size_mm / kTypical_mm));
    };
    if (!best || off(unit) < off(*best)) best = &unit;
  }
  return best;
}

void question_size(const TriangleMesh& mesh, double scale, const fs::path& path,
                   const RunContext& context) {
  const double across_mm = across(mesh);
  if (organ_sized(across_mm)) return;
  std::string text = path.string() + ": is " + in_words(across_mm) + " across, which no organ is; ";
  if (const UnitName* best = fitting_unit(across_mm / scale)) {
    text += "in " + std::string(best->name) + " (--unit " + best->name + ", " +
            to_text(best->size_mm / scale, 3) + " times as large) it would be " +
            in_words(across_mm / scale * best->size_mm);
  } else {
    const double factor = std::pow(10, std::round(std::log10(kTypical_mm / across_mm)));
    text += "no unit makes sense of it: scale it by about " + to_text(factor, 3);
  }
  context.warn(text);
}

// Of a coordinate in mm.
double scale_of(const fs::path& path, MeshUnit unit) {
  if (is_gltf(lower_ending(path))) return mm_per(MeshUnit::m);
  return unit != MeshUnit::mm && says_mm(path) ? 1 : mm_per(unit);
}

void tell_welds(const WeldSummary& weld, const fs::path& path, const RunContext& context) {
  if (weld.exact + weld.near == 0) return;
  std::string text = path.string() + ": " + std::to_string(weld.exact) +
                     " vertices that coincide with others were welded";
  if (weld.near > 0) {
    text +=
        ", and " + std::to_string(weld.near) + " within " + to_text(weld.tolerance_mm, 3) + " mm";
  }
  context.info(text);
}

}  // namespace

double mm_per(MeshUnit unit) {
  for (const UnitName& known : kUnits) {
    if (known.unit == unit) return known.size_mm;
  }
  return 1;
}

TriangleMesh read_mesh(const fs::path& path, MeshUnit unit, const RunContext& context) {
  check_readable(path);
  TriangleMesh mesh = read_by_ending(path);
  check_mesh(mesh, path.string());
  if (mesh.empty()) throw BadDataError(path, "holds no triangles");
  const double scale = scale_of(path, unit);
  if (scale != 1) {
    for (Eigen::Vector3d& v : mesh.vertices) v *= scale;
  }
  tell_welds(weld(mesh), path, context);
  if (mesh.empty()) throw BadDataError(path, "holds no triangles with an area");
  question_size(mesh, scale, path, context);
  return mesh;
}

std::string suspected_unit(const TriangleMesh& mesh, const fs::path& path, MeshUnit unit) {
  const double scale = scale_of(path, unit), across_mm = across(mesh);
  if (!organ_sized(across_mm)) {
    const UnitName* best = fitting_unit(across_mm / scale);
    return best ? best->name : "none";
  }
  for (const UnitName& known : kUnits)
    if (known.size_mm == scale) return known.name;
  return "mm";
}

}  // namespace organbake
