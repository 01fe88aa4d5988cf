// SPDX-License-Identifier: Apache-2.0
#pragma once

// What is drawn over the organ's picture, or in its place.

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/geometry/view_manifold.h"
#include "organbake/player/carried_surface.h"
#include "organbake/player/player.h"
#include "organbake/warp/view.h"
#include "window/window_state.h"

namespace organbake {

// Pictures of the bundle's true surface for the view and the deformation of a frame. They take a
// second or so, and are kept until either changes.
class TruthPictures {
 public:
  // Nothing can be shown when the bundle carries no surface; that is no error.
  TruthPictures(const std::filesystem::path& bundle_folder, ShellSurface shell);

  bool available() const { return available_; }
  // truth: the carried surface. polygons: the same picture painted flat onto the faces of
  // the shell's surface.
  // difference: |frame − truth| times four.
  const Rgb8Image& picture(Against against, const std::vector<Eigen::Vector3d>& positions,
                           const View& view, const Frame& frame, const DrawOptions& options);

 private:
  const CarriedSurface& surface();
  std::vector<Eigen::Vector3d> flattened(const std::vector<Eigen::Vector3d>& positions);

  std::filesystem::path bundle_folder_;
  ShellSurface shell_;
  bool available_;
  std::unique_ptr<CarriedSurface> surface_;  // read when it is first asked for
  Against kept_against_ = Against::nothing;
  View kept_view_;
  std::vector<Eigen::Vector3d> kept_positions_;
  Rgb8Image kept_;
};

// A frame of the player's organs as they are now, in the colours that were chosen (not none).
Rgb8Image measured_picture(const WindowState& state, const Player& player, const View& view,
                           const Frame& frame);

// Lines of the world over the picture, drawn into ImGui's background, where the picture lies.
class Overlay {
 public:
  Overlay(const View& view, const Eigen::Vector2i& corner_px, const Eigen::Vector2i& size_px);
  ~Overlay();
  Overlay(const Overlay&) = delete;
  Overlay& operator=(const Overlay&) = delete;

  void draw_proxy(const TriangleMesh& proxy, const std::vector<Eigen::Vector3d>& positions) const;
  void draw_tetrahedra(const TetrahedralBody& body,
                       const std::vector<Eigen::Vector3d>& nodes_mm) const;
  // The virtual cameras as pyramids; those in use are bright, as bright as they count.
  void draw_cameras(const CameraSet& cameras, const ViewWeights& active) const;
  // The VPM: the triangles of cameras, drawn between the cameras themselves.
  void draw_manifold(const CameraSet& cameras, const ViewWeights& active) const;

 private:
  void draw_line(Eigen::Vector3d a, Eigen::Vector3d b, std::uint32_t color) const;

  View view_;
  Eigen::Vector2d corner_px_;
};

}  // namespace organbake
