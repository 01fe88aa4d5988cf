// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewpoints/surface_samples.h"

#include <utility>

#include "geometry/mesh_checks.h"

namespace organbake {

TriangleMesh outward(TriangleMesh surface, const RunContext& context) {
  if (signed_volume(surface) >= 0 || !analyse_topology(surface).closed_manifold()) return surface;
  context.warn("the surface is inside out; its faces are taken the other way round");
  for (Face& face : surface.faces) std::swap(face[1], face[2]);
  return surface;
}

}  // namespace organbake
