// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/mechanics/dead_loads.h"

#include <Eigen/Geometry>
#include <span>

#include "organbake/geometry/adjacency.h"

namespace organbake {
namespace {

constexpr double kOnVertex = 0.5;
constexpr std::size_t kHeldOut = 3;  // every so manieth

Eigen::VectorXd patch_weights(std::uint32_t vertex, std::span<const std::uint32_t> ring,
                              const std::vector<bool>& anchored) {
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(anchored.size()));
  for (const std::uint32_t n : ring) weights[n] = anchored[n] ? 0 : 1;
  const double sum = weights.sum();
  if (sum > 0) weights *= (1 - kOnVertex) / sum;
  weights[vertex] = sum > 0 ? kOnVertex : 1;
  return weights;
}

Eigen::MatrixXd columns(const std::vector<Eigen::VectorXd>& loads, Eigen::Index rows) {
  Eigen::MatrixXd matrix(rows, static_cast<Eigen::Index>(loads.size()));
  for (std::size_t l = 0; l < loads.size(); ++l)
    matrix.col(static_cast<Eigen::Index>(l)) = loads[l];
  return matrix;
}

}  // namespace

DeadLoads patch_loads(const TriangleMesh& proxy, const std::vector<std::uint32_t>& anchors) {
  std::vector<bool> anchored(proxy.vertices.size(), false);
  for (const std::uint32_t a : anchors) anchored[a] = true;
  const VertexNeighbours rings(proxy.faces, proxy.vertices.size());
  const std::vector<Eigen::Vector3d> normals = vertex_normals(proxy);
  const auto rows = static_cast<Eigen::Index>(3 * proxy.vertices.size());
  std::vector<Eigen::VectorXd> fitted, held_out;
  std::size_t number = 0;
  for (std::uint32_t v = 0; v < proxy.vertices.size(); ++v) {
    if (anchored[v] || rings.of(v).empty()) continue;
    const Eigen::VectorXd weights = patch_weights(v, rings.of(v), anchored);
    auto& set = number++ % kHeldOut == kHeldOut - 1 ? held_out : fitted;
    const Eigen::Vector3d tangent = normals[v].unitOrthogonal();
    for (const Eigen::Vector3d& along :
         {Eigen::Vector3d(-normals[v]), tangent, Eigen::Vector3d(normals[v].cross(tangent))}) {
      const Eigen::Matrix3Xd force = along * weights.transpose();
      set.emplace_back(Eigen::Map<const Eigen::VectorXd>(force.data(), rows));
    }
  }
  return {columns(fitted, rows), columns(held_out, rows)};
}

}  // namespace organbake
