// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "core/error.h"
#include "core/text.h"
#include "geometry/mesh_checks.h"
#include "viewpoints/placement.h"
#include "viewpoints/spread_directions.h"

namespace organbake {
namespace {

// However wide the field of view, cameras keep this many of the organ's radii away.
constexpr double kLeastDistance = 1.5;

void check_range(const char* name, double value, double low, double high, const char* advice) {
  if (value >= low && value <= high) return;  // false for NaN
  throw UsageError(std::string(name) + " must be " + to_text(low) + "…" + to_text(high) + ", not " +
                   to_text(value) + advice);
}

// The vertices that faces use, about their bounds' centre.
struct CenteredPoints {
  Eigen::Vector3d center;
  std::vector<Eigen::Vector3d> points;
  double radius = 0;

  explicit CenteredPoints(const TriangleMesh& surface) {
    std::vector<bool> used(surface.vertices.size(), false);
    for (const Face& face : surface.faces) {
      for (const std::uint32_t vertex : face) used[vertex] = true;
    }
    Bounds box;
    for (std::size_t v = 0; v < used.size(); ++v) {
      if (!used[v]) continue;
      points.push_back(surface.vertices[v]);
      box.min = box.min.cwiseMin(points.back());
      box.max = box.max.cwiseMax(points.back());
    }
    center = box.center();
    for (Eigen::Vector3d& point : points) {
      point -= center;
      radius = std::max(radius, point.norm());
    }
  }
};

// How a camera at the centre's distance sees the points: rotated into its axes, z from the centre.
double farthest_off_axis(const Eigen::Matrix3d& rotation, const CenteredPoints& organ,
                         double distance) {
  double largest = 0;  // of |x|/z and |y|/z
  for (const Eigen::Vector3d& point : organ.points) {
    const Eigen::Vector3d p = rotation * point;
    const double off_axis = std::max(std::abs(p.x()), std::abs(p.y()));
    largest = std::max(largest, off_axis / (distance + p.z()));
  }
  return largest;
}

// The least distance at which no point lies farther off the axis than `tangent`: from
// max(|x|, |y|) ≤ tangent · (distance + z).
double least_distance(const Eigen::Matrix3d& rotation, const CenteredPoints& organ,
                      double tangent) {
  double distance = 0;
  for (const Eigen::Vector3d& point : organ.points) {
    const Eigen::Vector3d p = rotation * point;
    const double off_axis = std::max(std::abs(p.x()), std::abs(p.y()));
    distance = std::max(distance, off_axis / tangent - p.z());
  }
  return distance;
}

Eigen::Matrix3d view_rotation(const Eigen::Vector3d& direction) {
  return look_at(direction, Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitZ()).rotation;
}

Intrinsics fitted_intrinsics(const Eigen::Matrix3d& rotation, const CenteredPoints& organ,
                             double distance, const PlacementOptions& options) {
  // A surface seen along a line would have no size at all in the map.
  constexpr double kThinnest = 1e-3;
  const double tangent =
      std::max(farthest_off_axis(rotation, organ, distance), kThinnest * organ.radius / distance);
  const double focal = (0.5 - options.margin) * options.map_size / tangent;
  Intrinsics intrinsics;
  intrinsics.width = intrinsics.height = options.map_size;
  intrinsics.fx = intrinsics.fy = focal;
  intrinsics.cx = intrinsics.cy = 0.5 * options.map_size;
  return intrinsics;
}

std::vector<Eigen::Vector3d> directions_for(const PlacementOptions& options) {
  constexpr double kHalfTurn = std::numbers::pi;
  const ViewingCone all_round{.axis = {0, -1, 0}, .half_angle_rad = kHalfTurn};
  const ViewingCone& region = options.cone ? *options.cone : all_round;
  return spread_directions(options.count, region.axis, region.half_angle_rad);
}

}  // namespace

void PlacementOptions::check() const {
  check_range("count", count, 1, 256, " cameras");
  check_range("map_size", map_size, 8, 16384, " pixels");
  check_range("field_of_view_rad", field_of_view_rad, 0.01, 2.5, "");
  check_range("margin", margin, 0, 0.4, " (a share of the map)");
  if (!cone) return;
  check_range("the cone's half_angle_rad", cone->half_angle_rad, 0.01, 1.5,
              "; leave the cone out to place cameras all round");
  const double length = cone->axis.stableNorm();
  if (!(length > 0) || !std::isfinite(length)) {
    throw UsageError("the cone's axis must be finite and not zero");
  }
}

Placement place_cameras(const TriangleMesh& surface, const PlacementOptions& options,
                        const RunContext& context) {
  options.check();
  check_mesh(surface, "surface to place cameras round");
  const CenteredPoints organ(surface);
  if (!(organ.radius > 0) || !std::isfinite(organ.radius)) {
    throw BadDataError("surface to place cameras round: it has no (finite) extent");
  }
  const std::vector<Eigen::Vector3d> directions = directions_for(options);
  const double tangent = (1 - 2 * options.margin) * std::tan(0.5 * options.field_of_view_rad);
  double distance = kLeastDistance * organ.radius;
  for (const Eigen::Vector3d& direction : directions) {
    context.throw_if_cancelled();
    distance = std::max(distance, least_distance(view_rotation(direction), organ, tangent));
  }
  Placement placement;
  std::vector<Eigen::Vector3d> eyes;
  for (const Eigen::Vector3d& direction : directions) {
    context.throw_if_cancelled();
    eyes.push_back(organ.center + distance * direction);
    PosedCamera camera;
    camera.name = "cam_" + padded(placement.cameras.size(), 3);
    // Not look_at(eye, …) again: near the vertical its roll hangs on the eye's last digits.
    const Eigen::Matrix3d rotation = view_rotation(direction);
    camera.camera_from_world = {rotation, -(rotation * eyes.back())};
    camera.intrinsics = fitted_intrinsics(rotation, organ, distance, options);
    placement.cameras.push_back(std::move(camera));
  }
  build_view_manifold(organ.center, eyes, placement);
  return placement;
}

}  // namespace organbake
