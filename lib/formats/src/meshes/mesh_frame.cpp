// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/formats/mesh_frame.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <vector>

#include "organbake/core/error.h"
#include "organbake/core/union_find.h"
#include "organbake/geometry/mesh_edges.h"

namespace organbake {
namespace {

constexpr double kSmallest_mm = 5, kUsual_mm = 30, kLargest_mm = 2000;

// As write_ply(), gltf_binary() and obj_text() put them.
constexpr std::string_view kOurPly = "comment millimetres, LPS",
                           kOurScene = "x left, y superior, z anterior";

bool is_letter(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0; }

bool same_letter(char a, char b) {
  return std::toupper(static_cast<unsigned char>(a)) == std::toupper(static_cast<unsigned char>(b));
}

bool same_word(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), same_letter);
}

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
