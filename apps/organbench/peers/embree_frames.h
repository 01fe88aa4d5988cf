// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>

#include "organbake/geometry/triangle_mesh.h"
#include "organbake/image/channel_image.h"
#include "organbake/warp/view.h"

namespace organbake {

// A mesh that deforms, ray-traced as one does it with Embree: vertices rewritten, the tree
// refitted, one ray a pixel in packets of eight, rows spread over TBB, the vertices' colours
// interpolated.
class EmbreeFrames {
 public:
  // Throws BadDataError for a mesh without colours.
  explicit EmbreeFrames(const TriangleMesh& mesh);
  ~EmbreeFrames();

  // positions: one per vertex, mm.
  void draw(const std::vector<Eigen::Vector3d>& positions, const View& view, Rgb8Image& picture);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace organbake
