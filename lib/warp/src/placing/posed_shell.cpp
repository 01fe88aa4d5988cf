// SPDX-License-Identifier: Apache-2.0
#include "placing/posed_shell.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

#include "organbake/core/parallel.h"

namespace organbake {
namespace {

// Vertices or faces of a piece.
constexpr std::uint32_t kPosedGrain = 256;

// body(i) for each of 0 … count − 1, which write to nothing but their own.
void for_each_posed(std::size_t count, const auto& body) {
  parallel_pieces(std::uint32_t{0}, static_cast<std::uint32_t>(count), kPosedGrain,
                  [&](std::uint32_t i, std::uint32_t last) {
                    for (; i < last; ++i) body(i);
                  });
}

// What makes a face two-sided: a corner pushed by more than this share of the organ's size, and a
// normal farther from the mean of its corners' than 6°.
constexpr double kPushedShare = 0.02, kBentCosine = 0.995;

}  // namespace

PosedShell::PosedShell(ShellSurface shell)
    : shell_(std::move(shell)),
      pushed_mm_(kPushedShare * bounds(at_rest()).diagonal()),
      proxy_positions_(shell_.proxy().vertices),
      posed_(at_rest()),
      normals_(vertex_normals(posed_)),
      matrices_(shell_matrices(posed_)),
      revisions_(posed_.faces.size(), 0),
      two_sided_(posed_.faces.size(), 0),
      faces_of_(posed_.faces, posed_.vertices.size()) {
  if (!shell_.skin()) return;
  gradients_.emplace(at_rest());
  gradient_changes_.assign(normals_.size(), Eigen::Matrix3d::Zero());
}

void PosedShell::pose(const std::vector<Eigen::Vector3d>& proxy_positions) {
  if (proxy_positions == proxy_positions_) return;
  proxy_positions_ = proxy_positions;
  shell_.pose(proxy_positions_, next_vertices_);
  std::swap(posed_.vertices, next_vertices_);
  face_changed_.resize(posed_.faces.size());
  vertex_changed_.resize(posed_.vertices.size());
  // Moved vertices change their faces, those all their corners' normals, and these their faces.
  for_each_posed(posed_.faces.size(), [this](std::uint32_t f) {
    const Face& face = posed_.faces[f];
    face_changed_[f] = std::any_of(face.begin(), face.end(), [this](std::uint32_t v) {
      return posed_.vertices[v] != next_vertices_[v];
    });
  });
  for_each_posed(posed_.vertices.size(), [this](std::uint32_t v) {
    const auto faces = faces_of_.of(v);
    vertex_changed_[v] = std::any_of(faces.begin(), faces.end(),
                                     [this](std::uint32_t f) { return face_changed_[f] != 0; });
    if (vertex_changed_[v]) set_vertex(v);
  });
  for_each_posed(posed_.faces.size(), [this](std::uint32_t f) {
    const Face& face = posed_.faces[f];
    if (std::any_of(face.begin(), face.end(),
                    [this](std::uint32_t v) { return vertex_changed_[v] != 0; }))
      set_face(f);
  });
}

void PosedShell::set_vertex(std::uint32_t vertex) {
  set_normal(vertex);
  if (!gradients_) return;
  gradient_changes_[vertex] = shell_.skin()->is_creased(vertex)
                                  ? unknown_change()
                                  : gradients_->change(vertex, posed_.vertices, normals_);
}

void PosedShell::set_face(std::uint32_t face) {
  matrices_[face] = shell_matrix(posed_, normals_, face);
  if (gradients_) bend_face(at_rest(), face, gradient_changes_, matrices_[face]);
  two_sided_[face] = bent_over(face);
  ++revisions_[face];
}

// As vertex_normals() has it.
void PosedShell::set_normal(std::uint32_t vertex) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const std::uint32_t f : faces_of_.of(vertex)) {
    const Face& face = posed_.faces[f];
    const int corner = face[0] == vertex ? 0 : face[1] == vertex ? 1 : 2;
    sum += corner_angle(posed_, f, corner) * face_normal(posed_, f);
  }
  const double length = sum.norm();
  normals_[vertex] = length > 0 ? Eigen::Vector3d(sum / length) : Eigen::Vector3d::UnitZ();
}

bool PosedShell::bent_over(std::uint32_t f) const {
  const Face& face = posed_.faces[f];
  const bool pushed = std::any_of(face.begin(), face.end(), [&](std::uint32_t v) {
    return (posed_.vertices[v] - at_rest().vertices[v]).norm() > pushed_mm_;
  });
  if (!pushed) return false;
  const Eigen::Vector3d skin = normals_[face[0]] + normals_[face[1]] + normals_[face[2]];
  return face_normal(posed_, f).dot(skin) < kBentCosine * skin.norm();
}

}  // namespace organbake
