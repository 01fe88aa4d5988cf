// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "stereo/stereo_depth.h"

namespace organbake {

// Whether the eyes support the depth: enough of the tissue is matched, on the same rows, and surely
// enough.
DepthQuality judge_stereo(const StereoDepth& result, const PreparedFrame& left);

}  // namespace organbake
