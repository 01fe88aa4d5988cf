// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <numbers>
#include <string>

#include "cover_cameras.h"
#include "organ_frame.h"
#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/viewpoints/placement.h"
#include "spread_directions.h"

namespace organbake {
namespace {

void check_range(const char* name, double value, double low, double high, const char* advice) {
  if (value >= low && value <= high) return;  // false for NaN
  throw UsageError(std::string(name) + " must be " + to_text(low) + "…" + to_text(high) + ", not " +
                   to_text(value) + advice);
}

}  // namespace

void CoverageGoal::check() const {
  check_range("coverage", share, 0.5, 1, " of the reachable area");
  check_range("overlap", overlap, 1, 4, " cameras");
  check_range("texel", texel_mm, 0, 1000, " mm");
  check_range("view_gap", view_gap, 0, 1, " of a view");
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
