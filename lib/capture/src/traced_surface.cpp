// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/capture/traced_surface.h"

#include "organbake/core/error.h"
#include "organbake/geometry/mesh_checks.h"

namespace organbake {
namespace {

const TriangleMesh& checked(const TriangleMesh& surface) {
  check_mesh(surface, "surface");
  if (surface.empty()) throw BadDataError("surface: it has no faces");
  return surface;
}

}  // namespace

TracedSurface::TracedSurface(const TriangleMesh& surface)
    : mesh(checked(surface)), rays(surface), normals(surface) {}

}  // namespace organbake
