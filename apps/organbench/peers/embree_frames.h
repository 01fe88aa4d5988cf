// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "organbake/geometry/triangle_mesh.h"
#include "organbake/image/channel_image.h"
#include "organbake/warp/view.h"

namespace organbake {

struct EmbreeScene;
struct EmbreeLens;

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
  void trace_row(const EmbreeLens& lens, int y, Rgb8Image& picture) const;

  std::unique_ptr<EmbreeScene> scene_;
  std::vector<std::array<std::array<std::uint8_t, 3>, 3>> colors_;  // of each face's corners, sRGB
};

}  // namespace organbake
