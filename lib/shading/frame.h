// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "geometry/camera.h"
#include "image/channel_image.h"
#include "shading/grid.h"

namespace organbake {

struct FrameOptions {
  int halvings = 0;              // 0…4: of the frame's size, before anything else
  bool masks = true;             // look for the field of view, highlights and instruments
  bool piecewise_albedo = true;  // bring tissues of different colour to one albedo

  void check() const;  // throws UsageError
};

// A frame made ready to be read as shading.
struct PreparedFrame {
  Rgb8Image color;    // undistorted, of reduced size
  Intrinsics camera;  // of `color`; without distortion
  Plane intensity;    // linear, of one albedo
  Mask field;         // inside the round field of view
  Mask highlights;    // filled from around
  Mask instruments;
  Mask tissue;  // where there is depth: field without instruments
  Mask counts;  // where brightness is read: tissue without highlights
  bool was_combed = false;
  int albedo_regions = 1;
};

// A pinhole camera for frames of this size with the given horizontal field of view.
Intrinsics assumed_camera(int width, int height, double field_of_view_rad);

// Deinterlaces when combed, halves, undistorts, makes linear, masks. `camera` is of the frame as it
// comes. `given_instruments` (of the frame's size, may be null) replaces the search for
// instruments.
PreparedFrame prepare_frame(const Rgb8Image& frame, const Intrinsics& camera,
                            const FrameOptions& options, const Mask* given_instruments = nullptr);

}  // namespace organbake
