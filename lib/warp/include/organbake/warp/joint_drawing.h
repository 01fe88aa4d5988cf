// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "organbake/bundle/lighting.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/warp/draw_options.h"
#include "organbake/warp/frame.h"
#include "organbake/warp/view.h"
#include "organbake/warp/warper.h"

namespace organbake {

// What was drawn last, to recognise when nothing, or little, has changed since: one drawing, or, of
// organs that two eyes look at turn about, both eyes'.
class LastDrawing {
 public:
  // first_serial: of frames, for whoever draws beside another program's part that counts from 0.
  explicit LastDrawing(std::uint64_t first_serial = 0) : first_serial_(first_serial) {}

  // The report on the drawing of this view that the frame holds, the organs lying as in the last.
  std::optional<DrawReport> unchanged(const View& view, const DrawOptions& options,
                                      const Frame& frame) const;
  // Whether the frame holds the last one, of the same view, with at most other tools in it.
  bool continues(const View& view, const DrawOptions& options, const Frame& frame) const;

  // The frame holds this drawing from now on; still: organs lie as in the one before.
  void remember(const View& view, const DrawOptions& options, const DrawReport& report, bool still,
                Frame& frame);

 private:
  struct Drawing {
    View view;
    DrawOptions options;
    DrawReport report;
    std::uint64_t serial = 0;

    bool is_in(const Frame& frame) const { return serial != 0 && frame.serial == serial; }
  };
  std::uint64_t first_serial_;
  std::array<Drawing, 2> drawings_;  // the last one first
};

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

  // Throws what Warper::draw() does. The report has the sums of what was drawn, the largest
  // texels, and the first organ's cameras.
  DrawReport draw(const std::vector<Organ>& organs, const View& view, const DrawOptions& options,
                  Frame& frame);

 private:
  void join(const DrawOptions& options, float deeper_mm, Frame& frame) const;

  std::vector<Frame> pictures_;  // of each organ alone
  std::uint64_t serial_ = 0;     // of the last joint picture
};

}  // namespace organbake
