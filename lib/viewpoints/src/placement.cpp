// SPDX-License-Identifier: GPL-3.0-or-later
// The distance at which an organ fits all maps, in closed form for each vertex, and the camera in a
// direction at that distance.
#include "organbake/viewpoints/placement.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/geometry/mesh_checks.h"
#include "placing.h"

namespace organbake {
namespace {

// However wide the field of view, cameras keep this many of the organ's radii away.
constexpr double kLeastDistance = 1.5;
using Points = std::vector<Eigen::Vector3d>;

// How a camera at the centre's distance sees the points: rotated into its axes, z from the centre.
double farthest_off_axis(const Eigen::Matrix3d& rotation, const Points& points, double distance) {
  double largest = 0;  // of |x|/z and |y|/z
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector3d p = rotation * point;
    const double off_axis = std::max(std::abs(p.x()), std::abs(p.y()));
    largest = std::max(largest, off_axis / (distance + p.z()));
  }
  return largest;
}

// The least distance at which no point lies farther off the axis than `tangent`: from
// max(|x|, |y|) ≤ tangent · (distance + z).
double least_distance(const Eigen::Matrix3d& rotation, const Points& points, double tangent) {
  double distance = 0;
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector3d p = rotation * point;
    const double off_axis = std::max(std::abs(p.x()), std::abs(p.y()));
    distance = std::max(distance, off_axis / tangent - p.z());
  }
  return distance;
}

// All cameras of a cone are upright in the same way: as its axis asks.
Eigen::Matrix3d view_rotation(const Eigen::Vector3d& direction, const PlacementOptions& options) {
  const Eigen::Vector3d up = options.cone ? up_from(options.cone->axis) : Eigen::Vector3d::UnitZ();
  return look_at(direction, Eigen::Vector3d::Zero(), up).rotation;
}

}  // namespace

OrganFrame::OrganFrame(const TriangleMesh& surface) {
  std::vector<bool> used(surface.vertices.size(), false);
  for (const Face& face : surface.faces) {
    for (const std::uint32_t vertex : face) used[vertex] = true;
  }
  Bounds box;
  for (std::size_t v = 0; v < used.size(); ++v) {
    if (!used[v]) continue;
    points_.push_back(surface.vertices[v]);
    box.add(points_.back());
  }
  center_ = box.center();
  for (Eigen::Vector3d& point : points_) {
    point -= center_;
    radius_ = std::max(radius_, point.norm());
  }
  if (!(radius_ > 0) || !std::isfinite(radius_)) {
    throw BadDataError("surface to place cameras round: it has no (finite) extent");
  }
}

double OrganFrame::common_distance_mm(const std::vector<Eigen::Vector3d>& directions,
                                      const PlacementOptions& options,
                                      const RunContext& context) const {
  const double tangent = (1 - 2 * options.margin) * std::tan(0.5 * options.field_of_view_rad);
  double distance = kLeastDistance * radius_;
  for (const Eigen::Vector3d& direction : directions) {
    context.throw_if_cancelled();
    distance =
        std::max(distance, least_distance(view_rotation(direction, options), points_, tangent));
  }
  return distance;
}

PosedCamera OrganFrame::camera(const Eigen::Vector3d& direction, double distance_mm,
                               const PlacementOptions& options) const {
  PosedCamera camera;
  // Not look_at(eye, …): near the vertical its roll hangs on the eye's last digits.
  const Eigen::Matrix3d rotation = view_rotation(direction, options);
  const Eigen::Vector3d eye = center_ + distance_mm * direction;
  camera.camera_from_world = {rotation, -(rotation * eye)};
  // A surface seen along a line would have no size at all in the map.
  constexpr double kThinnest = 1e-3;
  const double tangent = std::max(farthest_off_axis(rotation, points_, distance_mm),
                                  kThinnest * radius_ / distance_mm);
  Intrinsics& intrinsics = camera.intrinsics;
  intrinsics.width = intrinsics.height = options.map_size;
  intrinsics.fx = intrinsics.fy = (0.5 - options.margin) * options.map_size / tangent;
  intrinsics.cx = intrinsics.cy = 0.5 * options.map_size;
  return camera;
}

// The placement of cameras and its viewing projection manifold (the paper, Figure 2): the dual of
// the polyhedron that the view planes bound. Vertices that differ by rounding are one, and their
// dual polygon is fanned from its lowest camera, so that symmetric sets come out the same
// everywhere.
namespace {

using Triangles = std::vector<std::array<std::uint32_t, 3>>;

// Far enough (in distances of the planes) that the box hides no vertex of three cameras, unless
// they stand within 1e-6 of one plane with the centre.
constexpr double kFarBox = 1 << 20;
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

void check_range(const char* name, double value, double low, double high, const char* advice) {
  if (value >= low && value <= high) return;  // false for NaN
  throw UsageError(std::string(name) + " must be " + to_text(low) + "…" + to_text(high) + ", not " +
                   to_text(value) + advice);
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

void CoverageGoal::check() const {
  check_range("coverage", share, 0.5, 1, " of the reachable area");
  check_range("overlap", overlap, 1, 4, " cameras");
  check_range("texel", texel_mm, 0, 1000, " mm");
  check_range("candidates", candidates, 16, 8192, " directions");
  check_range("samples", samples, 64, 65536, "");
}

void PlacementOptions::check() const {
  check_range("count", count, 1, 256, " cameras");
  check_range("map_size", map_size, 8, 16384, " pixels");
  check_range("field_of_view_rad", field_of_view_rad, 0.01, 2.5, "");
  check_range("margin", margin, 0, 0.4, " (a share of the map)");
  if (coverage) coverage->check();
  if (!cone) return;
  // As much over π/2 as its decimals are: nobody types all of them.
  constexpr double kHemisphere = 1.571;
  check_range("the cone's half_angle_rad", cone->half_angle_rad, 0.01, kHemisphere,
              "; leave the cone out to place cameras all round");
  const double length = cone->axis.stableNorm();
  if (!(length > 0) || !std::isfinite(length)) {
    throw UsageError("the cone's axis must be finite and not zero");
  }
}

ViewingCone PlacementOptions::region() const {
  ViewingCone region =
      cone.value_or(ViewingCone{.axis = ViewingCone().axis, .half_angle_rad = std::numbers::pi});
  if (cone) region.half_angle_rad = std::min(region.half_angle_rad, std::numbers::pi / 2);
  return region;
}

Placement placement_of(const OrganFrame& organ, const std::vector<Eigen::Vector3d>& directions,
                       double distance_mm, const PlacementOptions& options) {
  Placement placement;
  std::vector<Eigen::Vector3d> eyes;
  for (const Eigen::Vector3d& direction : directions) {
    eyes.push_back(organ.center_mm() + distance_mm * direction);
    placement.cameras.push_back(organ.camera(direction, distance_mm, options));
    placement.cameras.back().name = "cam_" + padded(placement.cameras.size() - 1, 3);
  }
  build_view_manifold(organ.center_mm(), eyes, placement);
  return placement;
}

Placement place_cameras(const TriangleMesh& surface, const PlacementOptions& options,
                        const RunContext& context) {
  options.check();
  check_mesh(surface, "surface to place cameras round");
  const OrganFrame organ(surface);
  if (options.coverage) return cover_with_cameras(surface, organ, options, context);
  const ViewingCone region = options.region();
  const std::vector<Eigen::Vector3d> directions =
      spread_directions(options.count, region.axis, region.half_angle_rad);
  const double distance = organ.common_distance_mm(directions, options, context);
  return placement_of(organ, directions, distance, options);
}

}  // namespace organbake
