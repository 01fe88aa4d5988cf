// SPDX-License-Identifier: GPL-3.0-or-later
// A force on a patch of skin dents it less than the same force through a tool's tip does: it is
// spread wider, and tetrahedra of the patch's size bend less than tissue. What is missing is told
// by how far a vertex sinks below those round it. Under a round punch of radius a an elastic
// half-space sinks by (1 − ν²)/(2 E a) per force, and by (1 − ν²)/(π E r) at the distance r
// (Johnson 1985, "Contact Mechanics", 3.2 and 3.4); by how much the body as a whole gives way is
// common to both, and told well by the tetrahedra. Their own dent is that of the tissue near the
// vertex, held some edges away: what is farther moves vertex and neighbours alike.
#include "skin_give.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/geometry/adjacency.h"
#include "organbake/mechanics/linear_statics.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr double kHeldFrom = 3;       // mean edges of the proxy
constexpr double kKiloPascal = 1e-3;  // N/mm²

// The tissue near a place with some of the vertices, in their order; nothing when none of it moves.
std::optional<MechanicsModel> tissue_near(const MechanicsModel& model, const Vector3d& at_mm,
                                          double within_mm,
                                          const std::vector<std::uint32_t>& vertices) {
  const TetrahedralBody& all = *model.body;
  MechanicsModel near;
  near.young_modulus_kpa = model.young_modulus_kpa;
  TetrahedralBody& body = near.body.emplace();
  body.poisson_ratio = all.poisson_ratio;
  body.nodes_mm = all.nodes_mm;
  std::vector<std::uint8_t> moves(all.nodes_mm.size(), 0), in_one(moves);
  for (std::size_t n = 0; n < moves.size(); ++n)
    moves[n] = (all.nodes_mm[n] - at_mm).norm() < within_mm;
  for (const std::uint32_t anchor : all.anchors) moves[anchor] = 0;
  for (const Tetrahedron& t : all.tetrahedra) {
    if (std::none_of(t.nodes.begin(), t.nodes.end(), [&](auto n) { return moves[n] != 0; }))
      continue;
    body.tetrahedra.push_back(t);
    for (const std::uint32_t n : t.nodes) in_one[n] = 1;
  }
  for (std::uint32_t n = 0; n < moves.size(); ++n)
    if (!moves[n] || !in_one[n]) body.anchors.push_back(n);
  if (body.anchors.size() == moves.size()) return std::nullopt;
  for (const std::uint32_t v : vertices) body.patches.push_back(all.patches[v]);
  body.vertices.resize(vertices.size());
  return near;
}

// By how much less the first of the vertices sinks below the others under a force on it than below
// them in an elastic half-space, under a tool's tip, mm per N.
double missing_dent(const TriangleMesh& proxy, const std::vector<std::uint32_t>& vertices,
                    const Vector3d& normal, const MechanicsModel& near, double radius_mm) {
  const auto count = static_cast<Eigen::Index>(vertices.size());
  Eigen::MatrixXd load = Eigen::MatrixXd::Zero(3 * count, 1);
  load.topRows<3>() = normal;
  const Eigen::MatrixXd moved = fem_displacements(near, load);
  const double nu = near.body->poisson_ratio,
               soft = (1 - nu * nu) / (kKiloPascal * near.young_modulus_kpa);
  double missing = soft / (2 * radius_mm) - normal.dot(Vector3d(moved.topRows<3>()));
  for (Eigen::Index k = 1; k < count; ++k) {
    const double away_mm = (proxy.vertices[vertices[k]] - proxy.vertices[vertices.front()]).norm();
    const double in_half_space = soft / (std::numbers::pi * std::max(away_mm, radius_mm));
    missing += (normal.dot(Vector3d(moved.middleRows<3>(3 * k))) - in_half_space) /
               static_cast<double>(count - 1);
  }
  return std::max(missing, 0.0);
}

}  // namespace

std::vector<double> skin_gives(const TriangleMesh& proxy, const MechanicsModel& model) {
  const VertexNeighbours neighbours(proxy.faces, proxy.vertices.size());
  const std::vector<Vector3d> normals = vertex_normals(proxy);
  const double within_mm = kHeldFrom * mean_edge_length(proxy);
  std::vector<std::uint8_t> held(proxy.vertices.size(), 0);
  for (const std::uint32_t anchor : model.anchors) held[anchor] = 1;
  std::vector<double> gives(proxy.vertices.size(), 0.0);
  parallel_for(std::uint32_t{0}, static_cast<std::uint32_t>(gives.size()), [&](std::uint32_t v) {
    std::vector<std::uint32_t> vertices = {v};
    for (const std::uint32_t n : neighbours.of(v)) vertices.push_back(n);
    if (held[v] || vertices.size() == 1) return;
    const auto near = tissue_near(model, proxy.vertices[v], within_mm, vertices);
    if (!near) return;
    try {
      gives[v] = missing_dent(proxy, vertices, normals[v], *near, model.instrument_radius_mm);
    } catch (const BadDataError&) {  // a loose part, held by nothing, which a tool pushes away
    }
  });
  return gives;
}

}  // namespace organbake
