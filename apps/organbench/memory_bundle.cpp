// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbench/memory_bundle.h"

#include <utility>

#include "capture/surface_color.h"
#include "mechanics/mechanics.h"

namespace organbake {

Bundle memory_bundle(const TriangleMesh& surface, const TriangleMesh& proxy,
                     const PlacementOptions& placement, const CaptureOptions& capturing) {
  const Placement placed = place_cameras(surface, placement);
  CaptureSummary captured =
      capture(surface, proxy, placed.cameras, *make_vertex_color(surface), capturing);
  Bundle bundle;
  bundle.proxy = proxy;
  bundle.cameras = {placed.cameras, {}, placed.manifold};
  bundle.mechanics = make_mechanics(proxy, {});
  bundle.maps = std::move(captured.maps);
  bundle.base = std::move(captured.base);
  return bundle;
}

}  // namespace organbake
