// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>

#include "organbake/shading/laparoscope.h"
#include "organbake/shading/prepared_frame.h"
#include "organbake/shading/ray_grid.h"

namespace organbake {

// What a frame itself tells of how far the relief that was read from its shading is to be believed.
struct ReliefEvidence {
  // Share of the brightness, at organ scale, that no smooth shape explains (RangeEstimate).
  double unexplained = 0;
  // Share 0…1 of the relief's variance (of ln z, over the picture) that is a tilt of the whole
  // view. A lamp's beam or a vignette that was not taken into account bends a picture into a bowl,
  // but cannot tilt it.
  double tilt_share = 0;
  // Correlation −1…1 of ln z with the hue (ln of green by red). Where pale tissue is read as near
  // and dark as far, several tissues were taken for a shape.
  double hue_correlation = 0;
};

// Over cells of a fiftieth of the frame's longer side that show diffuse tissue; all but the
// unexplained brightness is 0 where there are too few.
[[nodiscard]] ReliefEvidence relief_evidence(const PreparedFrame& frame,
                                             const RangeEstimate& estimate);

// How much is kept of the two parts of a relief (of ln z, over the picture), each 0…1.
struct ReliefShare {
  double tilt = 0;  // of the whole view, right and left, up and down
  double rest = 0;  // of what is left without it
};

// Of the logit of a share: constant, and by ln of the unexplained brightness, by the tilt's share
// and by the correlation with hue.
using ReliefShareTerms = std::array<double, 4>;
struct ReliefShareModel {
  ReliefShareTerms tilt, rest;
};
extern const ReliefShareModel kReliefShareModel;

// The shares of the relief that are safe to keep: chosen so that the error of depth is as small as
// may be without being larger than a plane's. All where a smooth shape explains the picture.
[[nodiscard]] ReliefShare relief_share(const ReliefEvidence& evidence,
                                       const ReliefShareModel& model = kReliefShareModel);

// Draws ln r to the plane across the axis that lies at the tissue's median depth: all of it for
// shares of 0, nothing for 1. The tilt is the least-squares plane of ln z over the tissue.
void keep_relief(const RayGrid& rays, const Mask& tissue, const ReliefShare& share,
                 Plane& log_range);

}  // namespace organbake
