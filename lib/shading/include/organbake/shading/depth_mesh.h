// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/geometry/camera.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/image/channel_image.h"
#include "organbake/shading/grid.h"

namespace organbake {

struct DepthMeshOptions {
  int step_px = 2;           // grid spacing
  double tear = 0.06;        // neighbours whose depths differ by more than this share aren't joined
  bool largest_only = true;  // keep the one largest piece

  void check() const;  // throws UsageError
};

// The surface that a depth map shows, in camera axes taken as world, coloured by the frame
// (linear; means over a step's pixels). Two triangles per grid cell, front to the camera, cut along
// a smooth curve a few pixels inside the border of the depth; cells with a gap or a jump stay
// open: nothing is invented where one viewpoint cannot have seen. Throws BadDataError when sizes
// differ or no cell is left.
TriangleMesh mesh_from_depth(const Plane& depth_mm, const Rgb8Image& color,
                             const Intrinsics& camera, const DepthMeshOptions& options);

}  // namespace organbake
