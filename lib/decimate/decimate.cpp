// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimate/decimate.h"

#include <string>

#include "core/error.h"
#include "decimate/edge_collapse.h"
#include "decimate/manifold_faces.h"
#include "decimate/mesh_distance.h"
#include "decimate/vertex_clustering.h"
#include "geometry/mesh_checks.h"

namespace organbake {
namespace {

// Samples a side: the RMS of 20,000 has a standard error below 0.5 % of itself.
constexpr std::size_t kErrorSamples = 20'000;
constexpr std::uint64_t kErrorSeed = 0x6465'6369'6d61'7465;

TriangleMesh reduce(const TriangleMesh& surface, const DecimateOptions& options,
                    const RunContext& context) {
  if (options.method == DecimateMethod::lindstrom_turk) {
    return collapse_edges(manifold_faces(surface), options.faces, context);
  }
  check_mesh(surface, "surface to decimate");
  if (surface.empty()) throw BadDataError("surface to decimate: it has no faces");
  return surface.faces.size() <= options.faces ? surface
                                               : cluster_vertices(surface, options.faces, context);
}

void check_budget(const TriangleMesh& proxy, const DecimateOptions& options) {
  if (proxy.empty()) {
    throw BadDataError("no grid of clusters gives between 1 and " + std::to_string(options.faces) +
                       " faces; allow more");
  }
  if (proxy.faces.size() > options.faces) {
    throw BadDataError("the surface cannot be reduced below " + std::to_string(proxy.faces.size()) +
                       " faces without changing its topology, but " +
                       std::to_string(options.faces) +
                       " were asked for; allow more, or keep fewer of its components");
  }
}

}  // namespace

void DecimateOptions::check() const {
  constexpr std::size_t kFewest = 4;  // a tetrahedron
  if (faces < kFewest) {
    throw UsageError("faces must be at least 4 (a tetrahedron), not " + std::to_string(faces));
  }
}

DecimateSummary decimate(const TriangleMesh& surface, const DecimateOptions& options,
                         const RunContext& context) {
  options.check();
  DecimateSummary summary;
  summary.proxy = reduce(surface, options, context);
  check_budget(summary.proxy, options);

  const MeshDistance forward =
      mesh_distance(surface, summary.proxy, kErrorSamples, kErrorSeed, context);
  const MeshDistance reverse =
      mesh_distance(summary.proxy, surface, kErrorSamples, kErrorSeed + 1, context);
  summary.rms_mm = forward.rms_mm;
  summary.max_mm = forward.max_mm;
  summary.reverse_rms_mm = reverse.rms_mm;
  summary.reverse_max_mm = reverse.max_mm;
  summary.closed_manifold = analyse_topology(summary.proxy).closed_manifold();
  const double volume = std::abs(signed_volume(surface));
  if (volume > 0) summary.volume_change = std::abs(signed_volume(summary.proxy)) / volume - 1;
  return summary;
}

}  // namespace organbake
