// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "organbake/options/options.h"
#include "organbake/shading/depth_mesh.h"
#include "organbake/shading/frame_depth.h"
#include "organbake/shading/frame_source.h"

namespace organbake {

struct ShadeStageOptions {
  ShadingOptions shading;
  SelectionOptions selection;
  FrameOptions frame{.halvings = 1};
  DepthMeshOptions mesh;
  Eigen::Vector3d light_offset_mm = Eigen::Vector3d::Zero();
  std::string light = "auto";                     // or "tilt,slant" in rad
  double field_of_view_rad = 1.2217304763960306;  // 70°
  int mesh_frame = -1;                            // −1 = the one with the most confidence
  int sharpest = 1;
  bool from_previous = true;
  bool strict = false;
  bool keep_light = false;  // in surface.ply's colours

  // Throws UsageError.
  void resolve();
};

void bind(OptionList& list, ShadeStageOptions& options);

}  // namespace organbake
