// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "organbake/warp/organ_source.h"

namespace organbake {

// The paper's own chain (2.2, Figure 2), kept as the baseline: the deformed proxy's depth is read
// at each virtual camera, the microstructure image distorted to it and added along the view, the
// result 3D-warped pixel by pixel, and the views combined over the viewing projection manifold.
// What lies beyond the proxy's outline has no macrostructure, and is lost. The same bytes for any
// number of threads.
class PaperWarp : public OrganDrawing {
 public:
  // Every map of the bundle must have been read, and be kept with it while this lives. Throws
  // UsageError without maps.
  explicit PaperWarp(const Bundle& bundle);

  // As Warper::draw(), of that bundle. The base layer is no part of the paper's chain and is not
  // drawn, and what skin each pixel shows is not told: to ask for it is a UsageError.
  DrawReport draw(const std::vector<Eigen::Vector3d>& positions, const View& view,
                  const DrawOptions& options, Frame& frame) const;
  // As Player::draw_by() takes it: of one organ that no blade has cut, else throws UsageError.
  DrawReport draw(const std::vector<JointDrawing::Organ>& organs, const View& view,
                  const DrawOptions& options, Frame& frame) override;

 private:
  struct Warped;
  Warped warp(std::size_t camera, const TriangleMesh& deformed, const View& view) const;
  static float blend(const std::vector<Warped>& views, std::size_t pixel, double same_surface,
                     const DrawOptions& options, Frame& frame);

  const Bundle& bundle_;
  ShellSurface shell_;
  // Per camera and texel, mm: what its surface lies behind the proxy at rest; +inf where either is
  // missing.
  std::vector<std::vector<float>> micro_depth_;
};

}  // namespace organbake
