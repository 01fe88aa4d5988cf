// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "organbake/warp/joint_drawing.h"

namespace organbake {

// Throws GraphicsError where a frame agrees less than GraphicsDrawing::kLeastAgreement_db with the
// processor's picture of the same.
void check_agreement(const std::vector<JointDrawing::Organ>& organs, const View& view,
                     const DrawOptions& options, const Frame& frame);

}  // namespace organbake
