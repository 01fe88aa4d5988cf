// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/capture/smooth_normals.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/raycast/ray_scene.h"

namespace organbake {

// A surface with what every part of a capture asks of it, which takes longer to make than most of
// them. Keeps a reference to the mesh; a mesh is taken where one of these is wanted.
struct TracedSurface {
  // Throws BadDataError for a mesh that is broken or has no faces.
  TracedSurface(const TriangleMesh& surface);  // NOLINT: as its mesh is one

  const TriangleMesh& mesh;
  RayScene rays;
  SmoothNormals normals;
};

}  // namespace organbake
