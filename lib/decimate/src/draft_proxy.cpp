// SPDX-License-Identifier: GPL-3.0-or-later
// A proxy for a first look. Vertex clustering (Rossignac & Borrel 1993), which takes any soup of
// faces, brings a scan's half a million faces to some thousands in one pass; collapses by quadrics
// without a queue (fast_collapse()) bring those to some hundreds, and Lindstrom–Turk's (1998) the
// rest to a proxy, for it is the last collapses that the error hangs on.
#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "organbake/decimate/decimate.h"
#include "organbake/decimate/mesh_defects.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/mesh_edges.h"
#include "proxies.h"

namespace organbake {
namespace {

constexpr int kSearchSteps = 40;
constexpr double kMostCells = 1e6;  // along the longest side; three such numbers fit in 64 bits

// Index of each used vertex's cluster, in order of first use; the means become vertices.
std::vector<std::uint32_t> assign_clusters(const TriangleMesh& surface, const Bounds& box,
                                           double cell_mm, TriangleMesh& result) {
  std::vector<std::uint32_t> cluster(surface.vertices.size(), 0xFFFFFFFFu);
  std::vector<std::size_t> members;
  std::unordered_map<std::uint64_t, std::uint32_t> known;
  for (const Face& face : surface.faces) {
    for (const std::uint32_t v : face) {
      if (cluster[v] != 0xFFFFFFFFu) continue;
      const Eigen::Vector3d at = (surface.vertices[v] - box.min) / cell_mm;
      std::uint64_t cell = 0;
      for (int axis = 0; axis < 3; ++axis) {
        cell = cell << 21 | static_cast<std::uint64_t>(at[axis]);
      }
      cluster[v] = known.emplace(cell, static_cast<std::uint32_t>(known.size())).first->second;
      if (cluster[v] == result.vertices.size()) {
        result.vertices.push_back(Eigen::Vector3d::Zero());
        members.push_back(0);
      }
      // Relative to the box: sums of large coordinates would lose digits.
      result.vertices[cluster[v]] += surface.vertices[v] - box.min;
      ++members[cluster[v]];
    }
  }
  for (std::size_t c = 0; c < members.size(); ++c) {
    result.vertices[c] = box.min + result.vertices[c] / static_cast<double>(members[c]);
  }
  return cluster;
}

// Faces with the same corners, whichever way they are wound.
struct WoundFace {
  Face corners;  // increasing
  int winding;   // +1 when the face is an even permutation of them
};

WoundFace wound_face(Face f) {
  int winding = 1;
  const auto order = [&](int i, int j) {
    if (f[i] > f[j]) {
      std::swap(f[i], f[j]);
      winding = -winding;
    }
  };
  order(0, 1);
  order(1, 2);
  order(0, 1);
  return {f, winding};
}

void add_faces(const TriangleMesh& surface, const std::vector<std::uint32_t>& cluster,
               TriangleMesh& result) {
  std::vector<WoundFace> candidates;
  for (const Face& f : surface.faces) {
    const Face mapped = {cluster[f[0]], cluster[f[1]], cluster[f[2]]};
    if (mapped[0] == mapped[1] || mapped[1] == mapped[2] || mapped[2] == mapped[0]) continue;
    candidates.push_back(wound_face(mapped));
  }
  std::sort(candidates.begin(), candidates.end(),
            [](const WoundFace& a, const WoundFace& b) { return a.corners < b.corners; });
  for (std::size_t first = 0, last = 0; first < candidates.size(); first = last) {
    int winding = 0;
    for (; last < candidates.size() && candidates[last].corners == candidates[first].corners;
         ++last) {
      winding += candidates[last].winding;
    }
    if (winding == 0) continue;
    Face f = candidates[first].corners;
    if (winding < 0) std::swap(f[1], f[2]);
    result.faces.push_back(f);
    if (!(face_area(result, result.faces.size() - 1) > 0)) result.faces.pop_back();
  }
}

// Clusters of the vertices in cells of a given size; see cluster_vertices().
TriangleMesh cluster_with_cell(const TriangleMesh& surface, double cell_mm) {
  const Bounds box = bounds(surface);
  TriangleMesh result;
  const std::vector<std::uint32_t> cluster = assign_clusters(surface, box, cell_mm, result);
  add_faces(surface, cluster, result);
  drop_unused_vertices(result);
  return result;
}

}  // namespace

TriangleMesh cluster_vertices(const TriangleMesh& surface, std::size_t faces,
                              const RunContext& context) {
  const Bounds box = bounds(surface);
  const double longest = (box.max - box.min).maxCoeff();
  TriangleMesh best;
  if (!(longest > 0) || !std::isfinite(longest)) return best;
  // The number of faces grows with that of cells, if not steadily: keep the best of all tried.
  double few_cells = 1, many_cells = kMostCells;
  for (int step = 0; step < kSearchSteps && many_cells > few_cells * (1 + 1e-6); ++step) {
    context.throw_if_cancelled();
    const double cells = std::sqrt(few_cells * many_cells);
    TriangleMesh tried = cluster_with_cell(surface, longest / cells);
    const bool fits = tried.faces.size() <= faces;
    (fits ? few_cells : many_cells) = cells;
    if (fits && tried.faces.size() > best.faces.size()) best = std::move(tried);
    context.progress(double(step + 1) / kSearchSteps);
  }
  return best;
}

// Clusters join sheets that lie closer than their cells: where no manifold comes of them, the
// collapses begin with the surface itself.

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
