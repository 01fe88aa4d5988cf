// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>

#include "organbake/shading/laparoscope.h"
#include "organbake/shading/prepared_frame.h"

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

// Of the logit of the share: constant, and by ln of the unexplained brightness, by the tilt's share
// and by the correlation with hue.
using ReliefShareModel = std::array<double, 4>;
extern const ReliefShareModel kReliefShareModel;

// The share 0…1 of the relief (of ln z) that is safe to keep: chosen so that the error of depth is
// as small as may be without being larger than a plane's. All where a smooth shape explains the
// picture.
[[nodiscard]] double relief_share(const ReliefEvidence& evidence,
                                  const ReliefShareModel& model = kReliefShareModel);

}  // namespace organbake
