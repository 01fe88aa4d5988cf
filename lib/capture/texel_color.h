// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "capture/camera_rays.h"
#include "capture/texel_tile.h"

namespace organbake {

// A texel whose centre sees the surface.
struct CenterHit {
  int x, y;
  RayHit hit;
};

// Colours of such texels: the mean over n × n points spread over each texel. Rays that miss, or
// meet another surface than the texel's centre did, are left out: nothing bleeds across an outline.
void color_texels(const CaptureScene& scene, const CameraRays& camera,
                  const std::vector<CenterHit>& centers, CameraMaps& maps);

}  // namespace organbake
