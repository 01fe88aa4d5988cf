// SPDX-License-Identifier: GPL-3.0-or-later
#include "lattice_body.h"

#include <algorithm>
#include <optional>

#include "organbake/raycast/ray_scene.h"

namespace organbake {
namespace {

// Columns from both sides fill the body twice, so each counts half.
constexpr double kShare = 0.5;
// Shares of the bounds' diagonal. A column must at least clear the faces it starts from.
constexpr double kStart = 1e-4;
constexpr double kLeastLength = 0.02;
constexpr double kLeastWeight = 0.05;  // corners that carry less are left out
constexpr double kLeastCosine = 0.7;   // of a vertex that passes as opposite

std::vector<RayHit> hits_opposite(const TriangleMesh& proxy,
                                  const std::vector<Eigen::Vector3d>& normals, double diagonal) {
  std::vector<Ray> rays(proxy.vertices.size());
  for (std::size_t v = 0; v < rays.size(); ++v) {
    rays[v] = {proxy.vertices[v], -normals[v], kStart * diagonal};
  }
  std::vector<RayHit> hits(rays.size());
  RayScene(proxy).first_hits(rays, hits);
  return hits;
}

std::optional<std::uint32_t> vertex_opposite(const TriangleMesh& proxy, std::uint32_t vertex,
                                             const Eigen::Vector3d& inward, double least_length,
                                             const std::vector<double>& vertex_area) {
  std::optional<std::uint32_t> best;
  double best_cosine = kLeastCosine;
  for (std::uint32_t other = 0; other < proxy.vertices.size(); ++other) {
    if (!(vertex_area[other] > 0)) continue;
    const Eigen::Vector3d way = proxy.vertices[other] - proxy.vertices[vertex];
    const double length = way.norm();
    if (length > least_length && way.dot(inward) / length > best_cosine) {
      best = other;
      best_cosine = way.dot(inward) / length;
    }
  }
  return best;
}

}  // namespace

void add_body_struts(const TriangleMesh& proxy, const std::vector<double>& vertex_area_mm2,
                     SpringNetwork& network) {
  const double diagonal = bounds(proxy).diagonal();
  const std::vector<Eigen::Vector3d> normals = vertex_normals(proxy);
  const std::vector<RayHit> hits = hits_opposite(proxy, normals, diagonal);
  for (std::uint32_t v = 0; v < proxy.vertices.size(); ++v) {
    const double column = kShare * vertex_area_mm2[v];
    if (!(column > 0)) continue;  // no face, no column
    const RayHit& hit = hits[v];
    if (hit.face != kNoHit && hit.t > kLeastLength * diagonal &&
        !has_corner(proxy.faces[hit.face], v)) {
      const double weights[3] = {1.0 - hit.u - hit.v, hit.u, hit.v};
      for (int c = 0; c < 3; ++c) {
        if (weights[c] < kLeastWeight) continue;
        network.add_bar(v, proxy.faces[hit.face][c], column * weights[c]);
      }
    } else if (const auto other = vertex_opposite(proxy, v, -normals[v], kLeastLength * diagonal,
                                                  vertex_area_mm2)) {
      network.add_bar(v, *other, column);
    }
  }
}

}  // namespace organbake
