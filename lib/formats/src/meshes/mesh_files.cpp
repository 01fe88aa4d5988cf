// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/formats/mesh_files.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <optional>
#include <string>

#include "meshes/gltf_reader.h"
#include "meshes/mesh_readers.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/mesh_edges.h"
#include "organbake/geometry/ply.h"
#include "organbake/geometry/weld.h"
#include "organbake/raycast/winding.h"
#include "vtk/legacy_vtk.h"
#include "vtk/vtk_xml_meshes.h"

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

// As much of a file as any header takes.
std::string head_of(const fs::path& path) {
  constexpr std::size_t kBytes = 16384;
  std::string head(kBytes, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(file.gcount()));
  return head;
}

WrittenMesh read_by_ending(const fs::path& path) {
  const std::string ending = lower_ending(path);
  if (ending == ".vtp") return read_vtp(path);
  if (ending == ".vtu") return read_vtu(path);
  const MeshFrame frame = frame_in_header(head_of(path), path.string());
  if (ending == ".ply") return {read_ply(path), frame};
  if (ending == ".stl") return {parsed(path, parse_stl), frame};
  if (ending == ".obj") return {parsed(path, parse_obj), frame};
  if (ending == ".off") return {parsed(path, parse_off), frame};
  if (ending == ".vtk") return {read_legacy_vtk(path), frame};
  if (is_gltf(ending)) return {read_gltf(path), frame};
  throw UsageError(path.string() + ": unknown mesh ending \"" + ending +
                   "\"; use .ply, .obj, .stl, .off, .vtk, .vtp, .vtu, .glb or .gltf");
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

MeshFrame chosen_frame(const MeshFrame& written, const MeshFrame& told, const fs::path& path,
                       const RunContext& context) {
  const bool gltf = is_gltf(lower_ending(path));
  return {chosen(written.unit, told.unit, gltf ? MeshUnit::m : MeshUnit::mm, path, context),
          chosen(written.space, told.space, gltf ? MeshSpace::y_up : MeshSpace::lps, path, context),
          written.ours, written.ours || written.unit || told.unit};
}

void bring_into_world(TriangleMesh& mesh, const MeshFrame& frame) {
  if (frame.unit == MeshUnit::mm && frame.space == MeshSpace::lps) return;
  const Eigen::Matrix3d world_from_file = mm_per(*frame.unit) * world_from_axes(*frame.space);
  for (Eigen::Vector3d& v : mesh.vertices) v = world_from_file * v;
}

std::string in_words(double mm) {
  return mm >= 1000 ? to_text(mm / 1000, 3) + " m" : to_text(mm, 3) + " mm";
}

// Small things are questioned where nobody has told their unit; what no organ can be, always. Of
// our own files, what made them was questioned.
void question_size(const TriangleMesh& mesh, const MeshFrame& written, const MeshFrame& taken,
                   const fs::path& path, const RunContext& context) {
  const MeshUnit unit = *taken.unit;
  const double across_mm = (bounds(mesh).max - bounds(mesh).min).maxCoeff();
  const bool small = may_be_organ(across_mm);
  if (taken.ours || organ_sized(across_mm) || (small && taken.unit_told)) return;
  std::string text = path.string() + ": is " + in_words(across_mm) +
                     (small ? " across, which few organs are; " : " across, which no organ is; ");
  if (written.unit) {
    text += "it says itself that it is in " + std::string(name_of(unit)) +
            ": scale it, or take that line out of its header";
  } else if (const auto best = unit_of_organ(across_mm / mm_per(unit))) {
    const double factor = mm_per(*best) / mm_per(unit);
    text += "in " + std::string(in_words(*best)) + " (--unit " + name_of(*best) +
            "; of a table or recipe unit=" + name_of(*best) + "; " + to_text(factor, 3) +
            " times as large) it would be " + in_words(across_mm * factor);
    if (small) text += ". If it is right, say --unit " + std::string(name_of(unit));
  } else {
    if (small) return;
    const double factor = std::pow(10, std::round(std::log10(kTypicalOrgan_mm / across_mm)));
    text += "no unit makes sense of it: scale it by about " + to_text(factor, 3);
  }
  context.warn(text);
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

TriangleMesh read_mesh(const fs::path& path, const MeshFrame& told, const RunContext& context) {
  MeshFrame taken;
  return read_mesh(path, told, context, taken);
}

TriangleMesh read_mesh(const fs::path& path, const MeshFrame& told, const RunContext& context,
                       MeshFrame& taken) {
  check_readable(path);
  auto [mesh, written] = read_by_ending(path);
  check_mesh(mesh, path.string());
  if (mesh.empty()) throw BadDataError(path, "holds no triangles");
  taken = chosen_frame(written, told, path, context);
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

}  // namespace organbake
