// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/geometry/shell.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/image/channel_image.h"
#include "organbake/warp/view.h"

namespace organbake {

// What a pixel of the truth shows.
struct TruthFrame {
  static constexpr int kRaysPerSide = 4, kRaysPerPixel = kRaysPerSide * kRaysPerSide;
  Rgb8Image color;  // mean of all rays
  Rgb8Image sharp;  // the one at the pixel's centre: as a warped frame, which takes one sample
  std::vector<std::uint8_t> covered;      // how many of a pixel's rays meet the surface
  std::vector<std::uint32_t> shell_face;  // at the pixel's centre; kNoFace off the surface
};

// The truth for a deformation: every vertex of the original surface carried in double precision by
// the same shell map as the baked samples, drawn with 4×4 rays a pixel and colours in linear light.
// It judges binding, drawing and blending; it does not judge the deformation itself.
class CarriedSurface {
 public:
  // Throws BadDataError for an empty surface or shell.
  CarriedSurface(TriangleMesh surface, ShellSurface shell);

  const TriangleMesh& at_rest() const { return rest_; }
  const std::vector<ShellBinding>& bindings() const { return bindings_; }

  // Positions of the surface's vertices when the proxy's are at proxy_positions.
  std::vector<Eigen::Vector3d> carry(const std::vector<Eigen::Vector3d>& proxy_positions) const;

  // Which vertices the view sees: inside the picture and not behind the surface, by a depth picture
  // of at least 1024² pixels.
  std::vector<bool> visible(const std::vector<Eigen::Vector3d>& positions, const View& view) const;

  // What the mesh, its vertices at any positions, shows at each pixel's centre: a face and the
  // weights of its corners.
  struct Seen {
    std::uint32_t face = kNoFace;  // of the surface
    float w1 = 0, w2 = 0;          // of corners 1 and 2
  };
  std::vector<Seen> seen_at_centers(const std::vector<Eigen::Vector3d>& positions,
                                    const View& view) const;
  // Its place when the vertices are at `positions`.
  Eigen::Vector3d point(const Seen& seen, const std::vector<Eigen::Vector3d>& positions) const;

  TruthFrame draw(const std::vector<Eigen::Vector3d>& positions, const View& view,
                  const std::array<std::uint8_t, 3>& background) const;

 private:
  TriangleMesh rest_;
  ShellSurface shell_;
  std::vector<ShellBinding> bindings_;
};

}  // namespace organbake
