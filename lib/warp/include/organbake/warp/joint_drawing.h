// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "organbake/bundle/lighting.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/warp/warper.h"

namespace organbake {

// Several organs in one picture: each is drawn by its own warper, and every pixel shows the one
// that is nearest to the eye, the first at ties. One light falls on all of them, that of the first
// organ that has one, its exposure metered over all. Outlines are smoothed once the organs are
// together: against the background, and against skin that lies so far behind that it is no longer
// one surface. One organ alone is drawn as its warper draws it.
class JointDrawing {
 public:
  // Nothing is kept by reference after draw().
  struct Organ {
    Warper& warper;
    const std::vector<Eigen::Vector3d>& positions_mm;  // of the proxy's vertices, world
    const TriangleMesh& proxy_at_rest;
    const std::optional<Lighting>& lighting;
  };

  // Throws what Warper::draw() does. The report has the sums of what was drawn and skipped, the
  // largest texels, and the first organ's cameras.
  DrawReport draw(const std::vector<Organ>& organs, const View& view, const DrawOptions& options,
                  Frame& frame);

 private:
  void join(const DrawOptions& options, float deeper_mm, Frame& frame) const;

  std::vector<Frame> pictures_;  // of each organ alone
  std::uint64_t serial_ = 0;     // of the last joint picture
};

}  // namespace organbake
