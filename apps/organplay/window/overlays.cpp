// SPDX-License-Identifier: Apache-2.0
#include "window/overlays.h"

#include <imgui.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>

namespace organbake {
namespace {

constexpr ImU32 kProxyFront = IM_COL32(120, 220, 255, 170),
                kProxyBack = IM_COL32(120, 220, 255, 40);
constexpr ImU32 kIdle = IM_COL32(150, 150, 150, 110), kManifold = IM_COL32(200, 160, 60, 110);

double share_of(const ViewWeights& active, std::size_t camera) {
  double share = 0;
  for (int i = 0; i < 3; ++i) {
    if (active.weights[i] > 0 && active.cameras[i] == camera) share += active.weights[i];
  }
  return share;
}

ImU32 bright(double share) { return IM_COL32(255, 200, 60, int(90 + 165 * share)); }

// A line of the world, cut where it comes before the near plane.
void draw_line(const View& view, Eigen::Vector3d a, Eigen::Vector3d b, ImU32 color) {
  a = view.camera.camera_from_world * a;
  b = view.camera.camera_from_world * b;
  if (a.z() > b.z()) std::swap(a, b);
  if (b.z() <= view.near_mm) return;
  if (a.z() < view.near_mm) a += (view.near_mm - a.z()) / (b.z() - a.z()) * (b - a);
  const Eigen::Vector2d from = project(view.camera.intrinsics, a);
  const Eigen::Vector2d to = project(view.camera.intrinsics, b);
  ImGui::GetBackgroundDrawList()->AddLine({float(from.x()), float(from.y())},
                                          {float(to.x()), float(to.y())}, color);
}

}  // namespace

void draw_proxy(const TriangleMesh& proxy, const std::vector<Eigen::Vector3d>& positions,
                const View& view) {
  const Eigen::Vector3d eye = view.camera.center_world_mm();
  for (const auto& [a, b, c] : proxy.faces) {
    const Eigen::Vector3d normal = (positions[b] - positions[a]).cross(positions[c] - positions[a]);
    const ImU32 color = normal.dot(eye - positions[a]) > 0 ? kProxyFront : kProxyBack;
    draw_line(view, positions[a], positions[b], color);
    draw_line(view, positions[b], positions[c], color);
    draw_line(view, positions[c], positions[a], color);
  }
}

void draw_cameras(const CameraSet& cameras, const ViewWeights& active, const View& view) {
  constexpr double kDepthShare = 0.12;  // of the way to the organ
  for (std::size_t i = 0; i < cameras.cameras.size(); ++i) {
    const PosedCamera& camera = cameras.cameras[i];
    const RigidTransform world_from_camera = camera.camera_from_world.inverse();
    const Eigen::Vector3d eye = world_from_camera.translation;
    const double z = kDepthShare * (eye - cameras.manifold.center_world_mm).norm();
    const double w = camera.intrinsics.width, h = camera.intrinsics.height;
    std::array<Eigen::Vector3d, 4> corners;
    const std::array<Eigen::Vector2d, 4> pixels = {{{0, 0}, {w, 0}, {w, h}, {0, h}}};
    for (int c = 0; c < 4; ++c) {
      corners[c] = world_from_camera * Eigen::Vector3d(z * unproject(camera.intrinsics, pixels[c]));
    }
    const double share = share_of(active, i);
    const ImU32 color = share > 0 ? bright(share) : kIdle;
    for (int c = 0; c < 4; ++c) {
      draw_line(view, eye, corners[c], color);
      draw_line(view, corners[c], corners[(c + 1) % 4], color);
    }
  }
}

void draw_manifold(const CameraSet& cameras, const ViewWeights& active, const View& view) {
  for (const auto& triangle : cameras.manifold.triangles) {
    const bool used = std::all_of(triangle.begin(), triangle.end(),
                                  [&](std::uint32_t c) { return share_of(active, c) > 0; });
    for (int c = 0; c < 3; ++c) {
      draw_line(view, cameras.cameras[triangle[c]].center_world_mm(),
                cameras.cameras[triangle[(c + 1) % 3]].center_world_mm(),
                used ? bright(0.5) : kManifold);
    }
  }
}

}  // namespace organbake
