// SPDX-License-Identifier: GPL-3.0-or-later
#include "measuring/scope_views.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace organbake {

using Eigen::Vector3d;

ScopeAim scope_aim(const TriangleMesh& proxy, const Vector3d& toward) {
  constexpr double kAround_mm = 15;
  const Vector3d& seen = *std::max_element(
      proxy.vertices.begin(), proxy.vertices.end(),
      [&](const Vector3d& a, const Vector3d& b) { return a.dot(toward) < b.dot(toward); });
  Vector3d normal = Vector3d::Zero();
  for (const Face& face : proxy.faces) {
    const Vector3d &a = proxy.vertices[face[0]], &b = proxy.vertices[face[1]],
                   &c = proxy.vertices[face[2]];
    if (((a + b + c) / 3 - seen).norm() < kAround_mm) normal += (b - a).cross(c - a);
  }
  return {seen, (normal.norm() > 0 ? normal : toward).normalized()};
}

View scope_view(const ScopeAim& aim, double range_mm, int width_px) {
  constexpr double kLean = 0.45;
  const Vector3d across = aim.normal.unitOrthogonal();
  const Vector3d away = (aim.normal + kLean * across).normalized();
  Eigen::Matrix3d rotation;
  rotation.row(2) = -away;
  rotation.row(0) = aim.normal.cross(across);
  rotation.row(1) = rotation.row(2).cross(rotation.row(0));
  const int height_px = width_px * 9 / 16;
  const double focal_px = kScopeFocal_widths * width_px;
  View view;
  view.camera.intrinsics = {width_px, height_px,      focal_px,
                            focal_px, 0.5 * width_px, 0.5 * height_px};
  view.camera.camera_from_world.rotation = rotation;
  view.camera.camera_from_world.translation = -rotation * (aim.point_mm + range_mm * away);
  return view;
}

}  // namespace organbake
