// SPDX-License-Identifier: GPL-3.0-or-later
// The stage: a surface is checked, what would stop a half-edge structure is mended, vertices with
// hundreds of faces are arranged otherwise, a method makes the proxy (fitted_proxy.cpp ours,
// collapse.cpp those of others), and errors, volume and topology of the result are measured.
#include "organbake/decimate/decimate.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/core/text.h"
#include "organbake/decimate/mesh_measures.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/mesh_edges.h"
#include "proxies.h"

namespace organbake {
namespace {

// Vertices of hundreds of faces become trees of small fans: every second spoke is flipped, again
// and again. A queue of edge collapses would look round all of them for each of its steps.

// More spokes than any surface of about even triangles has at a vertex. Edge collapses look at all
// of them for each, again and again: a thousand take ten seconds, two thousand a minute.
constexpr std::size_t kManySpokes = 128, kMostSpokes = 2000;

// The vertices round a vertex, in the order in which its faces are wound.
struct Rim {
  std::vector<std::uint32_t> vertices;
  bool closed = true;
};

class HubSplitter {
 public:
  explicit HubSplitter(TriangleMesh& mesh) : mesh_(mesh) {
    for (const Face& f : mesh.faces)
      for (int c = 0; c < 3; ++c) edges_.insert(edge_key(f[c], f[(c + 1) % 3]));
  }

  // faces: of the hub, before any fan was split. Leaves a hub that shares one with another fan.
  void split(std::uint32_t hub, std::span<const std::uint32_t> faces, std::vector<bool>& is_new) {
    for (const std::uint32_t f : faces)
      if (is_new[f]) return;
    Rim rim = rim_of(hub, faces);
    std::vector<Face> fan;
    for (std::size_t before = 0;
         rim.vertices.size() > kManySpokes && rim.vertices.size() != before;) {
      before = rim.vertices.size();
      rim.vertices = cut_every_second(hub, rim, fan);
    }
    const std::size_t n = rim.vertices.size(), left = rim.closed ? n : n - 1;
    for (std::size_t k = 0; k < left; ++k)
      fan.push_back({hub, rim.vertices[k], rim.vertices[(k + 1) % n]});
    for (std::size_t k = 0; k < faces.size(); ++k) {
      mesh_.faces[faces[k]] = fan[k];
      is_new[faces[k]] = true;
    }
  }

 private:
  Rim rim_of(std::uint32_t hub, std::span<const std::uint32_t> faces) const {
    std::unordered_map<std::uint32_t, std::uint32_t> next;
    std::unordered_set<std::uint32_t> reached;
    std::uint32_t start = kNoHalfEdge;
    for (const std::uint32_t f : faces) {
      std::uint32_t h = 3 * f;
      while (corner(h) != hub) h = next_in_face(h);
      const std::uint32_t a = corner(next_in_face(h)), b = corner(previous_in_face(h));
      if (start == kNoHalfEdge) start = a;
      next[a] = b;
      reached.insert(b);
    }
    Rim rim;
    for (const std::uint32_t f : faces)
      for (const std::uint32_t v : mesh_.faces[f])
        if (v != hub && !reached.contains(v)) start = v, rim.closed = false;
    for (std::uint32_t v = start; rim.vertices.size() <= faces.size(); v = next.at(v)) {
      rim.vertices.push_back(v);
      if (!next.contains(v) || next.at(v) == start) break;
    }
    return rim;
  }

  // Flips every second spoke into an edge between its neighbours; returns the rim that is left.
  std::vector<std::uint32_t> cut_every_second(std::uint32_t hub, const Rim& rim,
                                              std::vector<Face>& ears) {
    const std::vector<std::uint32_t>& all = rim.vertices;
    std::vector<std::uint32_t> left;
    for (std::size_t k = 0; k < all.size(); ++k) {
      const std::uint32_t b = all[(k + 1) % all.size()];
      const bool inside = k % 2 == 1 && (rim.closed || k + 1 < all.size());
      if (!inside || !may_flip(hub, all[k - 1], all[k], b)) {
        left.push_back(all[k]);
        continue;
      }
      ears.push_back({all[k - 1], all[k], b});
      edges_.erase(edge_key(hub, all[k]));
      edges_.insert(edge_key(all[k - 1], b));
    }
    return left;
  }

  // Whether the faces stay about where they were, and the surface manifold.
  bool may_flip(std::uint32_t hub, std::uint32_t a, std::uint32_t m, std::uint32_t b) const {
    constexpr double kCosine = 0.5;
    if (edges_.contains(edge_key(a, b))) return false;
    const Eigen::Vector3d was = (normal(hub, a, m) + normal(hub, m, b)).normalized();
    return normal(hub, a, b).normalized().dot(was) > kCosine &&
           normal(a, m, b).normalized().dot(was) > kCosine;
  }
  Eigen::Vector3d normal(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
    const auto& v = mesh_.vertices;
    return (v[b] - v[a]).cross(v[c] - v[a]);
  }
  std::uint32_t corner(std::uint32_t half_edge) const {
    return mesh_.faces[half_edge / 3][half_edge % 3];
  }

  TriangleMesh& mesh_;
  std::unordered_set<std::uint64_t> edges_;
};

std::vector<std::uint32_t> hubs_of(const TriangleMesh& mesh, const VertexFaces& around) {
  std::vector<std::uint32_t> hubs;
  for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v)
    if (around.of(v).size() > kManySpokes) hubs.push_back(v);
  return hubs;
}

}  // namespace

void split_hubs(TriangleMesh& mesh) {
  constexpr int kPasses = 4;  // two hubs may share faces
  VertexFaces around(mesh.faces, mesh.vertices.size());
  std::vector<std::uint32_t> hubs = hubs_of(mesh, around);
  if (hubs.empty()) return;
  HubSplitter splitter(mesh);
  for (int pass = 0; pass < kPasses && !hubs.empty(); ++pass) {
    std::vector<bool> is_new(mesh.faces.size(), false);
    for (const std::uint32_t hub : hubs) splitter.split(hub, around.of(hub), is_new);
    around = VertexFaces(mesh.faces, mesh.vertices.size());
    hubs = hubs_of(mesh, around);
  }
  for (const std::uint32_t hub : hubs) {
    if (around.of(hub).size() <= kMostSpokes) continue;
    throw BadDataError("surface to decimate: " + std::to_string(around.of(hub).size()) +
                       " faces meet at one vertex and cannot be arranged otherwise; mesh it anew");
  }
}

namespace {

// Samples a side: the RMS of 20,000 has a standard error below 0.5 % of itself.
constexpr std::size_t kErrorSamples = 20'000;
constexpr std::uint64_t kErrorSeed = 0x6465'6369'6d61'7465;

struct Reduced {
  TriangleMesh clean;  // what was reduced
  TriangleMesh proxy;  // by options.faces, not by what it serves
};

Reduced reduce(const TriangleMesh& surface, const DecimateOptions& options,
               const RunContext& context) {
  Reduced reduced{manifold_faces(surface), {}};
  split_hubs(reduced.clean);
  DecimateOptions first = options;
  first.max_share = 0;  // as if nothing were searched
  if (options.max_share > 0)
    first.faces = std::min({options.faces, options.most_faces, reduced.clean.faces.size()});
  reduced.proxy = proxy_with_faces(reduced.clean, first, first.faces, context);
  return reduced;
}

void check_budget(const TriangleMesh& proxy, const DecimateOptions& options) {
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
  require(faces >= 4, "faces", static_cast<double>(faces), "take at least 4, a tetrahedron's");
  require(max_share >= 0 && max_share <= 1, "max_share", max_share, "take 0…1");
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
  parallel_both([&] { regions = thickness_regions(surface, context); },
                [&] { reduced = reduce(surface, options, context); });
  const RegionMeter meter(surface, regions);
  MeasuredProxy found{std::move(reduced.proxy)};
  if (options.max_share > 0) {
    found = serving_proxy(reduced.clean, std::move(found.mesh), meter, options, context);
  } else {
    found.errors = meter.measure(found.mesh, context);
  }
  summary.proxy = std::move(found.mesh);
  check_budget(summary.proxy, options);
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
