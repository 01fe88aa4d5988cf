// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/geometry/view_manifold.h"
#include "organbake/warp/view.h"

namespace organbake {

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
