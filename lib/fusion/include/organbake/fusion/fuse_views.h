// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/fusion/depth_view.h"
#include "organbake/fusion/distance_volume.h"
#include "organbake/fusion/refine_poses.h"
#include "organbake/fusion/scaled_views.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// What lit the pictures, to be divided out of them.
enum class PictureLight {
  any,     // unknown: colours stay as they are
  camera,  // a lamp at the lens: brightness goes with the cosine over the distance squared
};

// Colours each vertex by all pictures that see it, the straighter and nearer the more; one that
// differs from the others (a highlight) counts less. What none sees takes its neighbours' colour.
// smooth[i] belongs to views[i]. Without any picture the mesh has no colours. Returns the share of
// vertices that a picture sees.
double color_by_views(const std::vector<DepthView>& views, const std::vector<SmoothView>& smooth,
                      PictureLight light, double surface_mm, TriangleMesh& mesh);

struct FusionOptions {
  double voxel_mm = 0;       // 0 = as fine as the depth maps' pixels
  double truncation_mm = 0;  // of the distances; 0 = by the voxels and the depths' noise
  double color_mm = 0;       // longest edge of the surface, for its colours; 0 = as voxels have it
  Holes holes = Holes::open;
  // Of the usual weight, what a border of an open surface must have: poorer fringes are cut off,
  // and the border is rounded. 0 = it stays as the voxels have it.
  double least_support = 0;
  PictureLight light = PictureLight::any;
  bool refine = false;  // the poses, which are then off by about:
  PoseRefinement off = {};
  DepthScale scale = DepthScale::automatic;
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
  std::optional<FusedScale> scale;   // how depths and poses came to one unit
  std::vector<PosedCamera> cameras;  // as they were used
};

// One surface of several depth maps. Throws BadDataError for a map that is not its camera's, that
// overlaps no other or is of another scale, and when no surface is left.
FusedSurface fuse_views(const std::vector<DepthView>& views, const FusionOptions& options,
                        const RunContext& context = {});

// How a view agrees with all the others about the surface.
struct ViewOverlap {
  double share = 0;     // of its points, those that another view sees, too
  double scale = 1;     // median of its depths over theirs, along their rays
  double agreeing = 1;  // share of those that lie where another view has the surface
  double spread = 0;    // median deviation of ln of its depths over theirs
};
// Whether hardly any of its points is seen by another view.
bool sees_nothing_in_common(const ViewOverlap& overlap);
// Whether few of its points lie where the others have a surface, and the rest all nearer or
// farther.
bool is_of_another_scale(const ViewOverlap& overlap);
std::vector<ViewOverlap> measure_overlap(const std::vector<SmoothView>& views);

// Throws BadDataError for a view that sees nothing that another one sees, or is of another scale.
void check_overlap(const std::vector<ViewOverlap>& overlaps, const std::vector<DepthView>& views);

}  // namespace organbake
