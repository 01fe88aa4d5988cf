// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/capture/skin_bake.h"

#include <cmath>

#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/geometry/mesh_checks.h"
#include "shell_hits.h"
#include "skin_targets.h"

namespace organbake {

SmoothSkin bake_smooth_skin(const TriangleMesh& surface, const TriangleMesh& proxy, double edge_mm,
                            const RunContext& context) {
  constexpr std::size_t kMostNodes = 100'000;
  if (!(edge_mm > 0) || !std::isfinite(edge_mm))
    throw UsageError("skin edge = " + to_text(edge_mm) + " mm: take a positive length");
  check_mesh(surface, "surface");
  check_mesh(proxy, "proxy");
  if (surface.empty() || proxy.empty())
    throw BadDataError(surface.empty() ? "surface: no faces for a skin to lie on"
                                       : "proxy: no faces for a skin to lie over");
  const RayScene rays(surface);
  const SmoothNormals normals(surface);
  const Lattice lattice(proxy, lattice_steps(proxy, edge_mm, kMostNodes));
  const std::vector<SkinTarget> targets =
      skin_targets(proxy, lattice, rays, normals, shell_reach_mm(surface, proxy), context);
  context.throw_if_cancelled();
  return skin_weights(proxy, lattice, targets);
}

}  // namespace organbake
