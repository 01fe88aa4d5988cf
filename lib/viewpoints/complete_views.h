// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "viewpoints/cover_scene.h"

namespace organbake {

// The cameras, and more of them at the worst views until views over the VPM miss, on average, no
// more than CoverageGoal::view_gap of what they show (see ViewCertificate).
Placement complete_views(const CoverScene& scene, const CoverScene::Directions& cameras);

}  // namespace organbake
