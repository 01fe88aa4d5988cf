// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/motion/clip_motion.h"
#include "organbake/motion/feature_tracker.h"
#include "organbake/options/options.h"

namespace organbake {

struct MotionStageOptions {
  TrackingOptions tracking;
  int key_frames = 12;
  int halvings = 1;                               // of the frames, before depth is sought for
  double field_of_view_rad = 1.2217304763960306;  // 70°: where the search for a lens starts
  // What makes lengths metric, first come.
  std::string known_distance;  // FRAME,X1,Y1,X2,Y2,MM
  double shaft_mm = 0;         // diameter of an instrument in view
  double range_mm = 0;
  double voxel = 0;
  bool shading = true;
  bool keep_light = false;
};

void bind(OptionList& list, MotionStageOptions& options);

}  // namespace organbake
