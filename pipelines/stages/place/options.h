// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/formats/mesh_files.h"
#include "organbake/options/options.h"
#include "organbake/viewpoints/placement.h"

namespace organbake {

struct PlaceStageOptions {
  PlacementOptions placement;
  Eigen::Vector3d cone_axis = ViewingCone().axis;
  double cone_angle_rad = 0;      // half angle; 0 = cameras all round
  CoverageGoal goal{.share = 0};  // share 0 = go by count
  int size_limit_px = 2048;       // of maps as fine as a picture
  CoverageDetail report = CoverageDetail::brief;
  MeshFrame frame;

  PlacementOptions resolved() const;
};

void bind(OptionList& list, PlaceStageOptions& options);

}  // namespace organbake
