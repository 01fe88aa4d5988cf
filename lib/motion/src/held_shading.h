// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/shading/frame_depth.h"
#include "plane_sweep.h"

namespace organbake {

struct HeldShadingOptions {
  // Share of the brightness that texture and gloss change without being shape.
  double texture = 0.3;
  // Share of the picture's width over which the albedo may change by itself: what brightness says
  // over longer ways is not believed.
  double albedo_share = 0.08;
  // Share of the width that shading reaches from where parallax is sure; farther off there is no
  // depth.
  double reach_share = 0.12;

  void check() const;  // throws UsageError
};

// Depth of one frame from parallax and shading in one solve: ln r is held to the swept depth where
// that is certain (robustly: what a smooth surface cannot follow is let go) and bends between so
// that the picture under the lamp at the lens is explained. The albedo's slow changes are free, so
// that only what is shorter than `albedo_share` comes from brightness. The depth is in the swept
// depth's unit, `metric` is the caller's to say. confidence: the certainty of parallax near the
// pixel. Throws BadDataError when sizes differ or nothing is certain.
FrameDepth fill_by_shading(const PreparedFrame& frame, const SweptDepth& swept,
                           const HeldShadingOptions& options);

}  // namespace organbake
