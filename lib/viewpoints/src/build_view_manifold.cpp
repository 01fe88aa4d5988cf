// SPDX-License-Identifier: GPL-3.0-or-later
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <string>

#include "organbake/core/error.h"
#include "organbake/viewpoints/placement.h"
#include "view_planes.h"

namespace organbake {
namespace {

using Triangles = std::vector<std::array<std::uint32_t, 3>>;

// Far enough (in distances of the planes) that the box hides no vertex of three cameras, unless
// they stand within 1e-6 of one plane with the centre.
constexpr double kFarBox = 1e6;
// The box of the surface that people look at; the farthest vertex of four even cameras is at 3.
constexpr double kDisplayBox = 4;
// Cameras nearer to each other than this have no face of their own.
constexpr double kLeastAngle_rad = 1e-4;
// Vertices nearer to each other than this share of their distance are one of more than three
// planes: symmetric sets are symmetric only to rounding and to where their search stopped.
constexpr double kSameVertex = 1e-6;

std::vector<Eigen::Vector3d> checked_directions(const Eigen::Vector3d& center,
                                                const std::vector<Eigen::Vector3d>& eyes) {
  std::vector<Eigen::Vector3d> directions;
  for (std::size_t c = 0; c < eyes.size(); ++c) {
    const Eigen::Vector3d arm = eyes[c] - center;
    const double length = arm.stableNorm();
    if (!(length > 0) || !std::isfinite(length)) {
      throw BadDataError("camera " + std::to_string(c) +
                         " stands at the organ's centre or nowhere (not finite); move it");
    }
    directions.push_back((arm / length).normalized());
    for (std::size_t other = 0; other < c; ++other) {
      if ((directions[other] - directions[c]).norm() > kLeastAngle_rad) continue;
      throw BadDataError("cameras " + std::to_string(other) + " and " + std::to_string(c) +
                         " look from the same direction; keep one of them");
    }
  }
  return directions;
}

// The cameras of each vertex of the VPM, vertices that differ by rounding taken together.
std::vector<std::set<std::uint32_t>> cameras_of_vertices(const PlanePolyhedron& polyhedron,
                                                         std::vector<Eigen::Vector3d>& positions) {
  std::vector<std::set<std::uint32_t>> cameras;
  for (const PlanePolyhedron::Vertex& vertex : polyhedron.vertices) {
    if (vertex.on_box) continue;
    const auto same = std::find_if(positions.begin(), positions.end(), [&](const auto& other) {
      return (vertex.position - other).norm() < kSameVertex * other.norm();
    });
    const auto index = static_cast<std::size_t>(same - positions.begin());
    if (same == positions.end()) {
      positions.push_back(vertex.position);
      cameras.emplace_back();
    }
    cameras[index].insert(vertex.planes.begin(), vertex.planes.end());
  }
  return cameras;
}

// The dual polygon of one vertex: its cameras counter-clockwise seen from outside, lowest first.
std::vector<std::uint32_t> dual_polygon(const std::set<std::uint32_t>& cameras,
                                        const Eigen::Vector3d& vertex,
                                        const std::vector<Eigen::Vector3d>& directions) {
  const Eigen::Vector3d normal = vertex.normalized(), first = directions[*cameras.begin()];
  const Eigen::Vector3d x = (first - normal * normal.dot(first)).normalized(), y = normal.cross(x);
  std::vector<std::uint32_t> polygon(cameras.begin(), cameras.end());
  std::vector<double> angle(directions.size(), 0.0);
  for (const std::uint32_t c : polygon) {
    angle[c] = std::atan2(directions[c].dot(y), directions[c].dot(x));
    if (c != polygon[0] && angle[c] < 0) angle[c] += 2 * std::numbers::pi;
  }
  angle[polygon[0]] = 0;
  std::sort(polygon.begin(), polygon.end(),
            [&](std::uint32_t a, std::uint32_t b) { return angle[a] < angle[b]; });
  return polygon;
}

Triangles dual_triangles(const PlanePolyhedron& polyhedron,
                         const std::vector<Eigen::Vector3d>& directions) {
  std::vector<Eigen::Vector3d> positions;
  const std::vector<std::set<std::uint32_t>> cameras = cameras_of_vertices(polyhedron, positions);
  Triangles triangles;
  for (std::size_t v = 0; v < positions.size(); ++v) {
    const std::vector<std::uint32_t> polygon = dual_polygon(cameras[v], positions[v], directions);
    for (std::size_t i = 2; i < polygon.size(); ++i) {
      triangles.push_back({polygon[0], polygon[i - 1], polygon[i]});
    }
  }
  std::sort(triangles.begin(), triangles.end());
  return triangles;
}

}  // namespace

void build_view_manifold(const Eigen::Vector3d& center, const std::vector<Eigen::Vector3d>& eyes,
                         Placement& placement) {
  ViewManifold manifold;
  manifold.center_world_mm = center;
  manifold.directions = checked_directions(center, eyes);
  double distance = 0;
  for (const Eigen::Vector3d& eye : eyes) distance = std::max(distance, (eye - center).norm());
  TriangleMesh surface;
  if (!eyes.empty()) {
    manifold.triangles =
        dual_triangles(intersect_view_planes(manifold.directions, kFarBox), manifold.directions);
    surface = intersect_view_planes(manifold.directions, kDisplayBox).surface;
    for (Eigen::Vector3d& vertex : surface.vertices) vertex = center + distance * vertex;
  }
  placement.manifold = std::move(manifold);
  placement.manifold_surface = std::move(surface);
}

}  // namespace organbake
