// SPDX-License-Identifier: GPL-3.0-or-later
#include "measuring/memory_bundle.h"

#include <utility>

#include "organbake/capture/capture.h"
#include "organbake/capture/surface_color.h"
#include "organbake/mechanics/mechanics.h"

namespace organbake {

Bundle memory_bundle(const TriangleMesh& surface, const TriangleMesh& proxy,
                     const PlacementOptions& placement, const CaptureOptions& capturing,
                     double skin_edge_mm) {
  const Placement placed = place_cameras(surface, placement);
  Bundle bundle;
  bundle.proxy = proxy;
  if (skin_edge_mm > 0) bundle.skin = bake_smooth_skin(surface, proxy, skin_edge_mm);
  CaptureResult captured = capture(surface, bundle.shell().at_rest(), placed.cameras,
                                   *make_vertex_color(surface), capturing);
  bundle.cameras = {placed.cameras, {}, placed.manifold};
  bundle.mechanics = make_mechanics(proxy, {});
  bundle.maps = std::move(captured.maps);
  bundle.base = std::move(captured.base);
  return bundle;
}

}  // namespace organbake
