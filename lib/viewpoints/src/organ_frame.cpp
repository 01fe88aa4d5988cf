// SPDX-License-Identifier: GPL-3.0-or-later
// The distance at which an organ fits all maps, in closed form for each vertex, and the camera in a
// direction at that distance.
#include "organ_frame.h"

#include <algorithm>
#include <cmath>

#include "organbake/core/error.h"
#include "organbake/viewpoints/placement.h"

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

}  // namespace organbake
