// SPDX-License-Identifier: Apache-2.0
// Pictures of the truth and of measurements in the place of the organ's, and marks over it.
#include "window/window.h"

#include <imgui.h>
#include <Eigen/Geometry>
#include <algorithm>
#include <cstdlib>
#include <utility>

#include "organbake/bundle/bundle_reader.h"
#include "organbake/player/false_colors.h"

namespace organbake {
TruthPictures::TruthPictures(const std::filesystem::path& bundle_folder, ShellSurface shell)
    : bundle_folder_(bundle_folder),
      shell_(std::move(shell)),
      available_(BundleReader(bundle_folder).has("surface.ply")) {}

const CarriedSurface& TruthPictures::surface() {
  if (!surface_) {
    surface_ =
        std::make_unique<CarriedSurface>(BundleReader(bundle_folder_).read_surface(), shell_);
  }
  return *surface_;
}

// Every point of the surface at its foot on the shell's surface: a polygon's texture.
std::vector<Eigen::Vector3d> TruthPictures::flattened(
    const std::vector<Eigen::Vector3d>& positions) {
  const TriangleMesh posed = shell_.posed(positions);
  std::vector<Eigen::Vector3d> flat;
  flat.reserve(surface().bindings().size());
  for (const ShellBinding& binding : surface().bindings()) {
    const auto& [a, b, c] = posed.faces[binding.face];
    const auto& v = posed.vertices;
    flat.push_back((1 - binding.b1 - binding.b2) * v[a] + binding.b1 * v[b] + binding.b2 * v[c]);
  }
  return flat;
}

const Rgb8Image& TruthPictures::picture(Against against,
                                        const std::vector<Eigen::Vector3d>& positions,
                                        const View& view, const Frame& frame,
                                        const DrawOptions& options) {
  if (against == kept_against_ && view == kept_view_ && positions == kept_positions_) return kept_;
  const std::vector<Eigen::Vector3d> vertices =
      against == Against::polygons ? flattened(positions) : surface().carry(positions);
  kept_ = surface().draw(vertices, view, options.background).color;
  if (against == Against::difference) {
    constexpr int kGain = 4;
    for (std::size_t i = 0; i < kept_.pixels.size(); ++i) {
      const int off = std::abs(int(kept_.pixels[i]) - int(frame.color.pixels[i]));
      kept_.pixels[i] = static_cast<std::uint8_t>(std::min(255, kGain * off));
    }
  }
  kept_against_ = against;
  kept_view_ = view;
  kept_positions_ = positions;
  return kept_;
}

Rgb8Image measured_picture(const WindowState& state, const Player& player, const View& view,
                           const Frame& frame) {
  const bool strain = state.colors == FalseColors::strain;
  std::vector<MeasuredSurface> surfaces;
  for (std::size_t o = 0; o < player.organ_count(); ++o) {
    const ShellSurface shell = player.bundle_now(o).shell();
    MeasuredSurface surface{shell.posed(player.proxy_positions(o)), {}};
    const TriangleMesh& rest = shell.at_rest();
    surface.values = strain ? surface_strain(rest.faces, rest.vertices, surface.posed.vertices)
                            : displacement_mm(rest.vertices, surface.posed.vertices);
    surfaces.push_back(std::move(surface));
  }
  const double most = strain ? state.most_strain : state.most_displacement_mm;
  return false_color_picture(frame, view, surfaces, strain ? -most : 0, most);
}

namespace {

constexpr ImU32 kProxyFront = IM_COL32(120, 220, 255, 170),
                kProxyBack = IM_COL32(120, 220, 255, 40);
constexpr ImU32 kIdle = IM_COL32(150, 150, 150, 110), kManifold = IM_COL32(200, 160, 60, 110),
                kCells = IM_COL32(150, 255, 170, 60);

double share_of(const ViewWeights& active, std::size_t camera) {
  double share = 0;
  for (int i = 0; i < 3; ++i) {
    if (active.weights[i] > 0 && active.cameras[i] == camera) share += active.weights[i];
  }
  return share;
}

ImU32 bright(double share) { return IM_COL32(255, 200, 60, int(90 + 165 * share)); }

}  // namespace

Overlay::Overlay(const View& view, const Eigen::Vector2i& corner_px, const Eigen::Vector2i& size_px)
    : view_(view), corner_px_(corner_px.cast<double>()) {
  const Eigen::Vector2i end_px = corner_px + size_px;
  ImGui::GetBackgroundDrawList()->PushClipRect({float(corner_px.x()), float(corner_px.y())},
                                               {float(end_px.x()), float(end_px.y())});
}

Overlay::~Overlay() { ImGui::GetBackgroundDrawList()->PopClipRect(); }

// Cut where it comes before the near plane.
void Overlay::draw_line(Eigen::Vector3d a, Eigen::Vector3d b, std::uint32_t color) const {
  a = view_.camera.camera_from_world * a;
  b = view_.camera.camera_from_world * b;
  if (a.z() > b.z()) std::swap(a, b);
  if (b.z() <= view_.near_mm) return;
  if (a.z() < view_.near_mm) a += (view_.near_mm - a.z()) / (b.z() - a.z()) * (b - a);
  const Eigen::Vector2d from = corner_px_ + project(view_.camera.intrinsics, a);
  const Eigen::Vector2d to = corner_px_ + project(view_.camera.intrinsics, b);
  ImGui::GetBackgroundDrawList()->AddLine({float(from.x()), float(from.y())},
                                          {float(to.x()), float(to.y())}, color);
}

void Overlay::draw_proxy(const TriangleMesh& proxy,
                         const std::vector<Eigen::Vector3d>& positions) const {
  const Eigen::Vector3d eye = view_.camera.center_world_mm();
  for (const auto& [a, b, c] : proxy.faces) {
    const Eigen::Vector3d normal = (positions[b] - positions[a]).cross(positions[c] - positions[a]);
    const ImU32 color = normal.dot(eye - positions[a]) > 0 ? kProxyFront : kProxyBack;
    draw_line(positions[a], positions[b], color);
    draw_line(positions[b], positions[c], color);
    draw_line(positions[c], positions[a], color);
  }
}

// Each edge once.
void Overlay::draw_tetrahedra(const TetrahedralBody& body,
                              const std::vector<Eigen::Vector3d>& nodes_mm) const {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const auto& tetrahedron : body.tetrahedra)
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < i; ++j)
        edges.push_back(std::minmax(tetrahedron.nodes[i], tetrahedron.nodes[j]));
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  for (const auto& [a, b] : edges) draw_line(nodes_mm[a], nodes_mm[b], kCells);
}

void Overlay::draw_cameras(const CameraSet& cameras, const ViewWeights& active) const {
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
      draw_line(eye, corners[c], color);
      draw_line(corners[c], corners[(c + 1) % 4], color);
    }
  }
}

void Overlay::draw_manifold(const CameraSet& cameras, const ViewWeights& active) const {
  for (const auto& triangle : cameras.manifold.triangles) {
    const bool used = std::all_of(triangle.begin(), triangle.end(),
                                  [&](std::uint32_t c) { return share_of(active, c) > 0; });
    for (int c = 0; c < 3; ++c) {
      draw_line(cameras.cameras[triangle[c]].center_world_mm(),
                cameras.cameras[triangle[(c + 1) % 3]].center_world_mm(),
                used ? bright(0.5) : kManifold);
    }
  }
}

}  // namespace organbake
