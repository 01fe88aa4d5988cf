// SPDX-License-Identifier: Apache-2.0
// Which three cameras show a view, and by what weights: the triangle of the viewing projection
// manifold (the paper, Figure 2) that the direction pierces, or the nearest place of its edges.
#include "organbake/geometry/view_manifold.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

namespace organbake {
namespace {

using Corners = std::array<Eigen::Vector3d, 3>;

// Barycentric coordinates of the direction in the cone of three directions (not normalised):
// d = Σ λ_i u_i by Cramer's rule; nullopt for three directions in one plane.
std::optional<Eigen::Vector3d> cone_coordinates(const Corners& u, const Eigen::Vector3d& d) {
  const double volume = u[0].dot(u[1].cross(u[2]));
  constexpr double kFlat = 1e-12;
  if (std::abs(volume) < kFlat) return std::nullopt;
  return Eigen::Vector3d(d.dot(u[1].cross(u[2])), d.dot(u[2].cross(u[0])),
                         d.dot(u[0].cross(u[1]))) /
         volume;
}

ViewWeights normalised(std::array<std::uint32_t, 3> cameras, Eigen::Vector3d lambda) {
  lambda = lambda.cwiseMax(0.0);
  const double sum = lambda.sum();
  ViewWeights result;
  result.cameras = cameras;
  for (int i = 0; i < 3; ++i) result.weights[i] = lambda[i] / sum;
  return result;
}

struct ArcPoint {
  double cosine;  // between the direction and its nearest point on the arc
  double at;      // 0 = first end, 1 = second end: weight of the second
};

// The nearest point to d on the great arc a → b, as chord weights, so that they agree with the
// triangle's own weights along the edge.
ArcPoint nearest_on_arc(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                        const Eigen::Vector3d& d) {
  const Eigen::Vector3d normal = a.cross(b);
  const Eigen::Vector3d in_plane =
      d - normal * (normal.dot(d) / std::max(normal.squaredNorm(), 1e-300));
  // in_plane = α a + β b, by the two edge functions.
  const double alpha = normal.dot(in_plane.cross(b)), beta = normal.dot(a.cross(in_plane));
  if (normal.squaredNorm() > 0 && alpha > 0 && beta > 0) {
    return {in_plane.norm(), beta / (alpha + beta)};
  }
  return a.dot(d) >= b.dot(d) ? ArcPoint{a.dot(d), 0.0} : ArcPoint{b.dot(d), 1.0};
}

// Cameras alone, when no triangle exists: the nearest take part by the angle left to the farthest.
ViewWeights nearest_cameras(const std::vector<Eigen::Vector3d>& directions,
                            const Eigen::Vector3d& d) {
  ViewWeights result;
  const std::uint32_t count =
      static_cast<std::uint32_t>(std::min<std::size_t>(directions.size(), 2));
  if (count == 1) result.weights[0] = 1;
  if (count < 2) return result;
  // The two nearest share along the arc between them; a third would need a triangle.
  std::vector<std::uint32_t> order(directions.size());
  for (std::uint32_t c = 0; c < order.size(); ++c) order[c] = c;
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return directions[a].dot(d) > directions[b].dot(d);
  });
  const ArcPoint arc = nearest_on_arc(directions[order[0]], directions[order[1]], d);
  result.cameras = {order[0], order[1], order[0]};
  result.weights = {1 - arc.at, arc.at, 0};
  return result;
}

// Beyond the hull: the nearest point of all triangle edges.
ViewWeights clamped_to_edge(const ViewManifold& manifold, const Eigen::Vector3d& d) {
  double best = -2;
  ViewWeights result;
  for (const auto& triangle : manifold.triangles) {
    for (int e = 0; e < 3; ++e) {
      const std::uint32_t a = triangle[e], b = triangle[(e + 1) % 3];
      const ArcPoint arc = nearest_on_arc(manifold.directions[a], manifold.directions[b], d);
      if (arc.cosine <= best) continue;
      best = arc.cosine;
      result.cameras = {a, b, triangle[(e + 2) % 3]};
      result.weights = {1 - arc.at, arc.at, 0};
    }
  }
  return result;
}

}  // namespace

ViewWeights view_weights(const ViewManifold& manifold, const Eigen::Vector3d& eye_direction) {
  const double length = eye_direction.norm();
  const Eigen::Vector3d d = length > 0 ? Eigen::Vector3d(eye_direction / length)
                                       : (manifold.directions.empty() ? Eigen::Vector3d::UnitZ()
                                                                      : manifold.directions[0]);
  // A direction on a shared edge pierces both triangles; either gives the same weights there.
  constexpr double kOnEdge = -1e-12;
  for (const auto& triangle : manifold.triangles) {
    const Corners corners = {manifold.directions[triangle[0]], manifold.directions[triangle[1]],
                             manifold.directions[triangle[2]]};
    const auto lambda = cone_coordinates(corners, d);
    if (lambda && lambda->minCoeff() >= kOnEdge) return normalised(triangle, *lambda);
  }
  if (!manifold.triangles.empty()) return clamped_to_edge(manifold, d);
  return nearest_cameras(manifold.directions, d);
}

}  // namespace organbake
