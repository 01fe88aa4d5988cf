// SPDX-License-Identifier: Apache-2.0
#include "warp/draw_state.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "geometry/shell_map.h"

namespace organbake {
namespace {

// What makes a face two-sided: a corner pushed by more than this share of the organ's size, and a
// normal farther from the mean of its corners' than 6°.
constexpr double kPushedShare = 0.02, kBentCosine = 0.995;

ShellColumns columns_of(const ShellMatrix& matrix) {
  ShellColumns columns = ShellColumns::Zero();
  columns.topRows<3>() = matrix.cast<float>();
  return columns;
}

bool bent_over(const TriangleMesh& deformed, const TriangleMesh& at_rest,
               const std::vector<Eigen::Vector3d>& normals, std::uint32_t f, double pushed_mm) {
  const Face& face = deformed.faces[f];
  const bool pushed = std::any_of(face.begin(), face.end(), [&](std::uint32_t v) {
    return (deformed.vertices[v] - at_rest.vertices[v]).norm() > pushed_mm;
  });
  if (!pushed) return false;
  const Eigen::Vector3d skin = normals[face[0]] + normals[face[1]] + normals[face[2]];
  return face_normal(deformed, f).dot(skin) < kBentCosine * skin.norm();
}

}  // namespace

std::vector<FaceFrame> face_frames(const TriangleMesh& deformed, const TriangleMesh& at_rest,
                                   const View& view) {
  const std::vector<Eigen::Vector3d> normals = vertex_normals(deformed);
  const double pushed_mm = kPushedShare * bounds(at_rest).diagonal();
  const RigidTransform& pose = view.camera.camera_from_world;
  const Intrinsics& k = view.camera.intrinsics;
  Eigen::Matrix3d projection;
  projection << k.fx, 0, k.cx, 0, k.fy, k.cy, 0, 0, 1;
  std::vector<FaceFrame> frames(deformed.faces.size());
  for (std::uint32_t f = 0; f < frames.size(); ++f) {
    frames[f].two_sided = bent_over(deformed, at_rest, normals, f, pushed_mm);
    ShellMatrix metric = pose.rotation * shell_matrix(deformed, normals, f);
    metric.col(0) += pose.translation;
    const ShellMatrix pixel = projection * metric;
    frames[f].metric = columns_of(metric);
    frames[f].pixel = columns_of(pixel);
  }
  return frames;
}

}  // namespace organbake
