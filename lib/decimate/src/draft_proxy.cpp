// SPDX-License-Identifier: GPL-3.0-or-later
// Vertex clustering (Rossignac & Borrel 1993) takes a scan's half a million faces to some thousands
// in one pass, collapses by quadrics without a queue (fast_collapse.h) those to some hundreds, and
// Lindstrom–Turk's (1998) what is left to a proxy: it is the last ones that the error hangs on.
// Clusters join sheets that lie closer than their cells: where no manifold comes of them, the
// collapses begin with the surface itself.
#include "draft_proxy.h"

#include <algorithm>
#include <cmath>

#include "organbake/decimate/collapse.h"
#include "organbake/decimate/fast_collapse.h"
#include "organbake/decimate/mesh_defects.h"
#include "organbake/geometry/mesh_edges.h"
#include "vertex_clustering.h"

namespace organbake {
namespace {

// Clusters leave so many faces that the collapses still choose where a proxy's belong.
constexpr std::size_t kFewestClustered = 6'000, kClusteredPerFace = 12;
// What Lindstrom–Turk's collapses begin with.
constexpr std::size_t kFewestToCollapse = 600, kToCollapsePerFace = 2;
// A surface has about so many faces where its area is that of one side of a cell.
constexpr double kFacesPerSide = 3;

// By clusters where they spare much.
TriangleMesh coarse_manifold(const TriangleMesh& surface, std::size_t faces) {
  const std::size_t wanted = std::max(kFewestClustered, kClusteredPerFace * faces);
  if (surface.faces.size() > 2 * wanted) {
    const double side_mm2 = kFacesPerSide * surface_area(surface) / static_cast<double>(wanted);
    TriangleMesh clustered = cluster_with_cell(surface, std::sqrt(side_mm2));
    if (!clustered.empty() && manifold_twins(clustered)) return clustered;
  }
  return manifold_faces(surface);
}

}  // namespace

TriangleMesh draft_proxy(const TriangleMesh& surface, std::size_t faces,
                         const RunContext& context) {
  const std::size_t thin_to = std::max(kFewestToCollapse, kToCollapsePerFace * faces);
  const TriangleMesh thinned = fast_collapse(coarse_manifold(surface, faces), thin_to, context);
  return collapse_edges(thinned, faces, context);
}

}  // namespace organbake
