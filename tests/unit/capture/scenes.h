// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>

#include "organbake/capture/capture.h"
#include "support/meshes.h"

namespace organbake {

// A camera whose every number differs from its neighbour's, so that a swap shows.
PosedCamera odd_camera(const Eigen::Vector3d& eye, const Eigen::Vector3d& target);
// A square one with a centred axis, `size` pixels across about 40°.
PosedCamera plain_camera(const Eigen::Vector3d& eye, const Eigen::Vector3d& target, int size);

// A square of side 2·half in the plane through `center`, facing `normal`, in cells² · 2 triangles.
TriangleMesh square_at(const Eigen::Vector3d& center, const Eigen::Vector3d& normal, double half,
                       int cells);
TriangleMesh painted(TriangleMesh mesh, const Eigen::Vector3f& color);

// A photograph of a mesh by its vertex colours (red, green … kept as they are: no light).
Photo photo_of(const TriangleMesh& mesh, const PosedCamera& camera);

// Colours of surface points found by shooting through a camera's pixels.
struct SurfaceSample {
  Eigen::Vector3d point;
  Eigen::Vector3f color;
};
std::vector<SurfaceSample> shade_through(const TriangleMesh& mesh, const SurfaceColor& color,
                                         const PosedCamera& camera);

}  // namespace organbake
