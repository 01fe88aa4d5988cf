// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <vector>

#include "core/run_context.h"
#include "fusion/distance_volume.h"
#include "fusion/refine_poses.h"
#include "fusion/view_color.h"

namespace organbake {

struct FusionOptions {
  double voxel_mm = 0;       // 0 = as fine as the depth maps' pixels
  double truncation_mm = 0;  // of the distances; 0 = by the voxels and the depths' noise
  Holes holes = Holes::open;
  PictureLight light = PictureLight::any;
  bool refine = false;  // the poses, which are then off by about:
  PoseRefinement off = {};
  std::size_t largest = 1;  // pieces of largest area that are kept; 0 = all

  void check() const;  // throws UsageError
};

struct FusedSurface {
  TriangleMesh mesh;  // world mm, coloured when a view has a picture
  double voxel_mm = 0, truncation_mm = 0;
  double noise_mm = 0;       // of the depth maps' pixels, median
  double apart_mm = 0;       // from view to view, along the normal, root mean square
  double colored_share = 0;  // of the vertices, seen by a picture
  std::optional<RefinedPoses> refined;
  std::vector<PosedCamera> cameras;  // as they were used
};

// One surface of several depth maps. Throws BadDataError for a map that is not its camera's, that
// overlaps no other or is of another scale, and when no surface is left.
FusedSurface fuse_views(const std::vector<DepthView>& views, const FusionOptions& options,
                        const RunContext& context = {});

}  // namespace organbake
