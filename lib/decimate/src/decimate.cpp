// SPDX-License-Identifier: GPL-3.0-or-later
// The stage: checks, defects that would stop a half-edge structure, the method, and what is told of
// the result.
#include "organbake/decimate/decimate.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "draft_proxy.h"
#include "error_search.h"
#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/core/text.h"
#include "organbake/decimate/mesh_defects.h"
#include "organbake/decimate/mesh_distance.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/mesh_edges.h"
#include "region_errors.h"
#include "serving_proxy.h"
#include "split_hubs.h"
#include "vertex_clustering.h"

namespace organbake {
namespace {

// Samples a side: the RMS of 20,000 has a standard error below 0.5 % of itself.
constexpr std::size_t kErrorSamples = 20'000;
constexpr std::uint64_t kErrorSeed = 0x6465'6369'6d61'7465;

struct Reduced {
  TriangleMesh clean;  // what was reduced
  TriangleMesh proxy;  // by options.faces or the largest error, not by what it serves
};

Reduced reduce(const TriangleMesh& surface, const DecimateOptions& options,
               const RunContext& context) {
  if (options.method == DecimateMethod::cluster) {
    if (surface.faces.size() <= options.faces) return {{}, surface};
    return {{}, cluster_vertices(surface, options.faces, context)};
  }
  if (options.method == DecimateMethod::draft)
    return {{}, draft_proxy(surface, options.faces, context)};
  Reduced reduced{manifold_faces(surface), {}};
  split_hubs(reduced.clean);
  reduced.proxy = options.max_error_mm > 0 ? fewest_faces(reduced.clean, options, context)
                  : options.max_share > 0
                      ? proxy_to_serve(reduced.clean, options, context)
                      : proxy_with_faces(reduced.clean, options, options.faces, context);
  return reduced;
}

// Neither of both can come as near to the surface as one may ask.
bool takes_budgets_alone(DecimateMethod method) {
  return method == DecimateMethod::cluster || method == DecimateMethod::draft;
}

bool is_searched(const DecimateOptions& options) {
  return options.max_share > 0 && !(options.max_error_mm > 0) &&
         !takes_budgets_alone(options.method);
}

void check_budget(const TriangleMesh& proxy, const DecimateOptions& options) {
  if (proxy.empty()) {
    throw BadDataError("no grid of clusters gives between 1 and " + std::to_string(options.faces) +
                       " faces; allow more");
  }
  if (proxy.faces.size() > (options.max_share > 0 ? options.most_faces : options.faces)) {
    throw BadDataError("the surface cannot be reduced below " + std::to_string(proxy.faces.size()) +
                       " faces without changing its topology, but " +
                       std::to_string(options.faces) +
                       " were asked for; allow more, or keep fewer of its components");
  }
}

void describe_topology(DecimateResult& summary) {
  const MeshTopology topology = analyse_topology(summary.proxy);
  summary.closed_manifold = topology.closed_manifold();
  summary.components = topology.components;
  summary.self_intersecting_faces = self_intersecting_faces(summary.proxy).size();
  summary.genus = -1;
  if (!manifold_twins(summary.proxy)) return;
  summary.boundary_loops = topology.boundary_loops;
  // χ = 2 components − 2 genus − loops
  summary.genus = (2 * static_cast<long>(topology.components) -
                   static_cast<long>(summary.boundary_loops) - topology.euler_characteristic) /
                  2;
}

void measure(DecimateResult& summary, const TriangleMesh& surface, const RayScene& scene,
             const RegionErrors& errors, const RunContext& context) {
  const MeshDistance forward =
      mesh_distance(surface, RayScene(summary.proxy), kErrorSamples, kErrorSeed, context);
  const MeshDistance reverse =
      mesh_distance(summary.proxy, scene, kErrorSamples, kErrorSeed + 1, context);
  summary.rms_mm = forward.rms_mm;
  summary.reverse_rms_mm = reverse.rms_mm;
  summary.max_mm = errors.max_mm;
  summary.reverse_max_mm = errors.reverse_max_mm;
  summary.worst_share = errors.worst_share;
  summary.worst_mm = errors.worst_mm;
  summary.worst_thickness_mm = errors.worst_thickness_mm;
  const double volume = std::abs(signed_volume(surface));
  if (volume > 0) summary.volume_change = std::abs(signed_volume(summary.proxy)) / volume - 1;
}

}  // namespace

void DecimateOptions::check() const {
  constexpr std::size_t kFewest = 4;  // a tetrahedron
  if (faces < kFewest) {
    throw UsageError("faces must be at least 4 (a tetrahedron), not " + std::to_string(faces));
  }
  if (!(max_error_mm >= 0) || !std::isfinite(max_error_mm)) {
    throw UsageError("max-error must be a length of 0 mm or more, not " +
                     std::to_string(max_error_mm));
  }
  if (!(max_share >= 0 && max_share <= 1))
    throw UsageError("max-share must be 0…1, not " + to_text(max_share));
  if (max_error_mm > 0 && takes_budgets_alone(method)) {
    throw UsageError(
        "max-error needs a method that can come as near as asked for; cluster and draft cannot");
  }
}

DecimateResult decimate(const TriangleMesh& surface, const DecimateOptions& options,
                        const RunContext& context) {
  options.check();
  DecimateResult summary;
  check_mesh(surface, "surface to decimate");
  if (surface.empty()) throw BadDataError("surface to decimate: it has no faces");
  // Neither needs the other, and much of both is done by one thread.
  ThicknessRegions regions;
  Reduced reduced;
  const auto measure_regions = [&] {
    if (options.method != DecimateMethod::draft) regions = thickness_regions(surface, context);
  };
  parallel_both(measure_regions, [&] { reduced = reduce(surface, options, context); });
  const RegionMeter meter(surface, regions);
  MeasuredProxy found{std::move(reduced.proxy)};
  if (is_searched(options)) {
    found = serving_proxy(reduced.clean, std::move(found.mesh), meter, options, context);
  } else {
    found.errors = meter.measure(found.mesh, context);
  }
  summary.proxy = std::move(found.mesh);
  if (!(options.max_error_mm > 0)) check_budget(summary.proxy, options);
  measure(summary, surface, meter.scene(), found.errors, context);
  describe_topology(summary);
  if (summary.self_intersecting_faces > 0) {
    context.warn(std::to_string(summary.self_intersecting_faces) +
                 " faces of the proxy cross others; allow another number of faces");
  }
  return summary;
}

std::size_t faces_for_tool(const TriangleMesh& surface, double tool_radius_mm) {
  constexpr double kEdgeInRadii = 3;
  constexpr double kFewest = 80, kMost = 1500;
  if (!(tool_radius_mm > 0) || !std::isfinite(tool_radius_mm))
    throw UsageError("tool_radius = " + to_text(tool_radius_mm) + " mm: take a positive length");
  const double edge_mm = kEdgeInRadii * tool_radius_mm;
  const double face_mm2 = std::sqrt(3.0) / 4 * edge_mm * edge_mm;
  const double faces = std::clamp(surface_area(surface) / face_mm2, kFewest, kMost);
  return 2 * static_cast<std::size_t>(faces / 2);  // a closed mesh has an even number
}

}  // namespace organbake
