// SPDX-License-Identifier: GPL-3.0-or-later
// A surface mesh, whatever its format, in the world: the format is told by the file's first bytes,
// or else by its name; its coordinates become millimetres in LPS by what the file says of itself,
// or by what its reader was told; open edges are welded, closed pieces wound outward, and sizes
// that no organ has are questioned.
#include "organbake/formats/mesh_files.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <map>
#include <vector>

#include "meshes/mesh_readers.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/core/union_find.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/mesh_edges.h"
#include "organbake/geometry/ply.h"
#include "organbake/geometry/polygon.h"
#include "organbake/raycast/face_queries.h"

namespace organbake {
namespace fs = std::filesystem;
namespace {

void check_readable(const fs::path& path) {
  if (!fs::exists(path)) throw NoInputError(path, "does not exist");
  if (!fs::is_regular_file(path)) throw NoInputError(path, "is not a file");
  if (!std::ifstream(path)) throw NoInputError(path, "cannot be opened");
  if (fs::file_size(path) == 0) throw BadDataError(path, "is empty");
}

struct FormatName {
  MeshFormat format;
  const char *ending, *words;
};
constexpr FormatName kFormats[] = {{MeshFormat::ply, ".ply", "PLY"},
                                   {MeshFormat::obj, ".obj", "OBJ"},
                                   {MeshFormat::stl, ".stl", "STL"},
                                   {MeshFormat::off, ".off", "OFF"},
                                   {MeshFormat::legacy_vtk, ".vtk", "VTK's legacy format"},
                                   {MeshFormat::vtk_polydata, ".vtp", "VTK XML of polydata"},
                                   {MeshFormat::vtk_grid, ".vtu", "VTK XML of a grid"},
                                   {MeshFormat::gltf, ".glb", "glTF"},
                                   {MeshFormat::gltf, ".gltf", "glTF"}};

// Of a VTK XML file, by the type that its first tag names.
std::optional<MeshFormat> format_of_xml(std::string_view head, const fs::path& path) {
  constexpr std::string_view kTag = "<VTKFile", kType = "type=";
  const std::size_t tag = head.find(kTag);
  if (tag == head.npos) return std::nullopt;
  const std::string_view all = head.substr(tag, head.find('>', tag) - tag);
  const std::size_t at = all.find(kType);
  if (at == all.npos || at + kType.size() >= all.size()) return std::nullopt;
  const char quote = all[at + kType.size()];
  const std::string_view rest = all.substr(at + kType.size() + 1);
  const std::string_view type = rest.substr(0, rest.find(quote));
  if (type == "PolyData") return MeshFormat::vtk_polydata;
  if (type == "UnstructuredGrid") return MeshFormat::vtk_grid;
  throw BadDataError(path, "is a VTK XML file of \"" + std::string(type) +
                               "\", which is no surface; PolyData and UnstructuredGrid are read");
}

// Of formats that begin with a word of their own.
std::optional<MeshFormat> format_of_content(std::string_view head, const fs::path& path) {
  if (head.starts_with("# vtk DataFile Version")) return MeshFormat::legacy_vtk;
  if (head.starts_with("ply\n") || head.starts_with("ply\r")) return MeshFormat::ply;
  if (head.starts_with("glTF")) return MeshFormat::gltf;
  const std::size_t first = head.find_first_not_of("\xEF\xBB\xBF \t\r\n");
  const std::string_view text = first == head.npos ? std::string_view() : head.substr(first);
  if (text.starts_with("<?xml") || text.starts_with("<VTKFile") || text.starts_with("<!--"))
    return format_of_xml(text, path);
  return std::nullopt;
}

// A file is read by what it is; its name tells that where its first bytes do not.
MeshFormat format_of(const fs::path& path, std::string_view head, const RunContext& context) {
  const std::string ending = lower_ending(path);
  const auto named = std::find_if(std::begin(kFormats), std::end(kFormats),
                                  [&](const FormatName& known) { return ending == known.ending; });
  if (named == std::end(kFormats))
    throw UsageError(path.string() + ": unknown mesh ending \"" + ending +
                     "\"; use .ply, .obj, .stl, .off, .vtk, .vtp, .vtu, .glb or .gltf");
  const MeshFormat found = format_of_content(head, path).value_or(named->format);
  if (found == named->format) return found;
  const auto is = std::find_if(std::begin(kFormats), std::end(kFormats),
                               [&](const FormatName& known) { return found == known.format; });
  context.warn(path.string() + ": is " + is->words + " by its content and read as that; name it " +
               is->ending + ", not " + ending);
  return found;
}

// Most organs are of the first four; what reads the others is loaded with the first of them.
WrittenMesh read_as(MeshFormat format, const fs::path& path, std::string_view head,
                    const RunContext& context) {
  const bool xml = format == MeshFormat::vtk_polydata || format == MeshFormat::vtk_grid;
  WrittenMesh read;
  if (!xml) read.frame = frame_in_header(head, path.string());
  const auto text = [&] { return read_text_file(path); };
  switch (format) {
    case MeshFormat::ply:
      read.mesh = read_ply(path);
      break;
    case MeshFormat::stl:
      read.mesh = parse_stl(text(), path.string());
      break;
    case MeshFormat::obj:
      read.mesh = parse_obj(text(), path.string());
      break;
    case MeshFormat::off:
      read.mesh = parse_off(text(), path.string());
      break;
    default:
      static const auto read_by_module = reinterpret_cast<decltype(&organbake_meshes)>(
          module_door("organbake_meshes", "organbake_meshes"));
      read_by_module(format, path, context, read);
  }
  return read;
}

// What a file says of one thing outranks what its reader was told.
template <class Value>
Value chosen(const std::optional<Value>& written, const std::optional<Value>& told, Value usual,
             const fs::path& path, const RunContext& context) {
  if (written && told && *written != *told)
    context.info(path.string() + ": says itself that it is in " + name_of(*written) + "; " +
                 name_of(*told) + " is for files that don't say");
  return written ? *written : told.value_or(usual);
}

MeshFrame chosen_frame(const MeshFrame& written, const MeshFrame& told, bool gltf,
                       const fs::path& path, const RunContext& context) {
  return {chosen(written.unit, told.unit, gltf ? MeshUnit::m : MeshUnit::mm, path, context),
          chosen(written.space, told.space, gltf ? MeshSpace::y_up : MeshSpace::lps, path, context),
          written.ours, written.ours || written.unit || told.unit};
}

void bring_into_world(TriangleMesh& mesh, const MeshFrame& frame) {
  if (frame.unit == MeshUnit::mm && frame.space == MeshSpace::lps) return;
  const Eigen::Matrix3d world_from_file = mm_per(*frame.unit) * world_from_axes(*frame.space);
  for (Eigen::Vector3d& v : mesh.vertices) v = world_from_file * v;
}

// With three digits behind the point, or as many as it takes to be no zero.
std::string in_figures(double value) {
  constexpr double kTiny = 1e-12;
  if (!(value > kTiny)) return to_text(value);
  return to_text(value, std::max(3, -static_cast<int>(std::floor(std::log10(value)))));
}

std::string in_words(double mm) {
  return mm >= 1000 ? in_figures(mm / 1000) + " m" : in_figures(mm) + " mm";
}

// What no organ can be is questioned always, small things where nobody has told their unit
// (plausible_size). Of our own files, what made them was questioned.
void question_size(const TriangleMesh& mesh, const MeshFrame& written, const MeshFrame& taken,
                   const fs::path& path, const RunContext& context) {
  const MeshUnit unit = *taken.unit;
  const double across_mm = (bounds(mesh).max - bounds(mesh).min).maxCoeff();
  const bool small = may_be_organ(across_mm);
  if (taken.ours || plausible_size(mesh, taken.unit_told)) return;
  std::string text = path.string() + ": is " + in_words(across_mm) +
                     (small ? " across, which few organs are; " : " across, which no organ is; ");
  if (written.unit) {
    text += "it says itself that it is in " + std::string(name_of(unit)) +
            ": scale it, or take that line out of its header";
  } else if (const auto best = unit_of_organ(across_mm / mm_per(unit)); best && *best != unit) {
    const double factor = mm_per(*best) / mm_per(unit);
    text += "in " + std::string(in_words(*best)) + " (--unit " + name_of(*best) +
            "; of a table or recipe unit=" + name_of(*best) + "; " + in_figures(factor) +
            " times as large) it would be " + in_words(across_mm * factor);
    if (small) text += ". If it is right, say --unit " + std::string(name_of(unit));
  } else {
    if (small) return;
    const double factor = std::pow(10, std::round(std::log10(kTypicalOrgan_mm / across_mm)));
    text += "no unit makes sense of it: scale it by about " + in_figures(factor);
  }
  context.warn(text);
}

void tell_welds(const WeldSummary& weld, const fs::path& path, const RunContext& context) {
  if (weld.exact + weld.near == 0) return;
  std::string text = path.string() + ": " + std::to_string(weld.exact) +
                     " vertices that coincide with others were welded";
  if (weld.near > 0)
    text +=
        ", and " + std::to_string(weld.near) + " within " + to_text(weld.tolerance_mm, 3) + " mm";
  context.info(text);
}

constexpr double kSmallest_mm = 5, kUsual_mm = 30, kLargest_mm = 2000;

// As write_ply(), gltf_binary() and obj_text() put them.
constexpr std::string_view kOurPly = "comment millimetres, LPS",
                           kOurScene = "x left, y superior, z anterior";

bool is_letter(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0; }

bool same_letter(char a, char b) {
  return std::toupper(static_cast<unsigned char>(a)) == std::toupper(static_cast<unsigned char>(b));
}

bool same_word(std::string_view a, std::string_view b) { return lower_case(a) == lower_case(b); }

// Calls take(value) for every KEY=value, in any letters.
template <class Take>
void each_value(std::string_view text, std::string_view key, const Take& take) {
  auto at = text.begin();
  while ((at = std::search(at, text.end(), key.begin(), key.end(), same_letter)) != text.end()) {
    const bool begins = at == text.begin() || !is_letter(*(at - 1));
    at += static_cast<std::ptrdiff_t>(key.size());
    if (!begins || at == text.end() || *at != '=') continue;
    const auto end = std::find_if_not(++at, text.end(), is_letter);
    take(std::string_view(at, end));
  }
}

bool is_axes(std::string_view word) {
  return word.size() == 3 && word.find_first_not_of("LRPASIlrpasi") == word.npos;
}

// What is seen of an organ, and no whole one: as if a tenth of it or more were cut off. By the area
// that each rim spans as a vector (half the sum of a × b along it, Stokes), so that slits and seams
// span none.
bool is_part_of_a_surface(const TriangleMesh& mesh) {
  constexpr double kLeastShare = 0.1;
  UnionFind rims(mesh.vertices.size());
  std::vector<std::uint32_t> open;  // half-edges
  const std::vector<std::uint32_t> twins = half_edge_twins(mesh);
  const auto ends = [&](std::uint32_t h) {
    const Face& face = mesh.faces[h / 3];
    return std::pair(face[h % 3], face[next_in_face(h) % 3]);
  };
  for (std::uint32_t h = 0; h < twins.size(); ++h) {
    if (twins[h] != kNoHalfEdge) continue;
    open.push_back(h);
    const auto [a, b] = ends(h);
    rims.join(a, b);
  }
  std::map<std::uint32_t, Eigen::Vector3d> spanned;
  for (const std::uint32_t h : open) {
    const auto [a, b] = ends(h);
    const Eigen::Vector3d& origin = mesh.vertices[rims.root(a)];
    auto& area = spanned.try_emplace(rims.root(a), Eigen::Vector3d::Zero()).first->second;
    area += 0.5 * (mesh.vertices[a] - origin).cross(mesh.vertices[b] - origin);
  }
  double missing = 0;
  for (const auto& [rim, area] : spanned) missing += area.norm();
  return missing >= kLeastShare * (missing + surface_area(mesh));
}

template <class Rows, class Value, class Member>
const auto& row_of(const Rows& rows, Value value, Member member) {
  return *std::find_if(std::begin(rows), std::end(rows),
                       [&](const auto& row) { return row.*member == value; });
}

}  // namespace

TriangleMesh read_mesh(const fs::path& path, const MeshFrame& told, const RunContext& context) {
  MeshFrame taken;
  return read_mesh(path, told, context, taken);
}

TriangleMesh read_mesh(const fs::path& path, const MeshFrame& told, const RunContext& context,
                       MeshFrame& taken) {
  check_readable(path);
  constexpr std::size_t kLongestHeader = 16384;
  const std::string head = read_beginning(path, kLongestHeader);
  const MeshFormat format = format_of(path, head, context);
  auto [mesh, written] = read_as(format, path, head, context);
  check_mesh(mesh, path.string());
  if (mesh.empty()) throw BadDataError(path, "holds no triangles");
  taken = chosen_frame(written, told, format == MeshFormat::gltf, path, context);
  bring_into_world(mesh, taken);
  std::vector<std::uint32_t> twins = half_edge_twins(mesh);
  if (std::find(twins.begin(), twins.end(), kNoHalfEdge) != twins.end()) {
    tell_welds(weld(mesh), path, context);
    if (mesh.empty()) throw BadDataError(path, "holds no triangles with an area");
    twins = half_edge_twins(mesh);
  }
  for (const std::string& turned : turn_outward(mesh, std::move(twins)).sentences())
    context.warn(path.string() + ": " + turned);
  question_size(mesh, written, taken, path, context);
  return std::move(mesh);
}

double mm_per(MeshUnit unit) { return row_of(kMeshUnits, unit, &UnitName::unit).size_mm; }

const char* name_of(MeshUnit unit) { return row_of(kMeshUnits, unit, &UnitName::unit).name; }

const char* in_words(MeshUnit unit) { return row_of(kMeshUnits, unit, &UnitName::unit).words; }

const char* name_of(MeshSpace space) { return row_of(kMeshSpaces, space, &SpaceName::space).name; }

Eigen::Matrix3d world_from_axes(MeshSpace space) {
  if (space == MeshSpace::ras) return Eigen::Vector3d(-1, -1, 1).asDiagonal();
  Eigen::Matrix3d world = Eigen::Matrix3d::Identity();
  if (space == MeshSpace::y_up) world << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  return world;
}

MeshFrame frame_in_header(std::string_view header, const std::string& name) {
  MeshFrame frame;
  if (header.find(kOurPly) != header.npos) frame = {MeshUnit::mm, MeshSpace::lps, true};
  if (header.find(kOurScene) != header.npos) frame = {MeshUnit::m, MeshSpace::y_up, true};
  each_value(header, "SPACE", [&](std::string_view value) {
    for (const SpaceName& known : kMeshSpaces)
      if (same_word(value, known.letters)) frame.space = known.space;
    if (!frame.space && is_axes(value))
      throw BadDataError(name + ": its header says SPACE=" + std::string(value) +
                         "; LPS, RAS and LSA are read; save it in one of those");
  });
  for (const char* key : {"UNIT", "UNITS"})
    each_value(header, key, [&](std::string_view value) {
      for (const UnitName& known : kMeshUnits)
        if (same_word(value, known.name)) frame.unit = known.unit;
    });
  return frame;
}

bool organ_sized(double across_mm) { return across_mm >= kUsual_mm && across_mm <= kLargest_mm; }

bool may_be_organ(double across_mm) {
  return across_mm >= kSmallest_mm && across_mm <= kLargest_mm;
}

bool plausible_size(const TriangleMesh& mesh_mm, bool unit_told) {
  const double across_mm = (bounds(mesh_mm).max - bounds(mesh_mm).min).maxCoeff();
  return organ_sized(across_mm) ||
         (may_be_organ(across_mm) && (unit_told || is_part_of_a_surface(mesh_mm)));
}

std::optional<MeshUnit> unit_of_organ(double across_units) {
  const auto off = [&](const UnitName& unit) {
    const double rare = unit.unit == MeshUnit::inch ? 1 : 0;  // where centimetres will do
    return rare + std::abs(std::log(across_units * unit.size_mm / kTypicalOrgan_mm));
  };
  for (const auto fits : {organ_sized, may_be_organ}) {
    const UnitName* best = nullptr;
    for (const UnitName& unit : kMeshUnits)
      if (fits(across_units * unit.size_mm) && (!best || off(unit) < off(*best))) best = &unit;
    if (best) return best->unit;
  }
  return std::nullopt;
}

}  // namespace organbake
