// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/core/run_context.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/raycast/ray_scene.h"
#include "thickness_regions.h"

namespace organbake {

// How far a proxy and its surface lie apart, and what that means where the surface is thin.
struct RegionErrors {
  double max_mm = 0, reverse_max_mm = 0;  // surface → proxy, proxy → surface: largest_distance()
  // Of the region where the larger of both is the largest share of its thickness; zeros where no
  // thickness is known.
  double worst_share = 0, worst_mm = 0, worst_thickness_mm = 0;
};

// A point of a proxy's face and the surface's point that it should be nearer to.
struct FarPoint {
  double share = 0;  // of the distance, of the thickness there
  Eigen::Vector3d on_surface = Eigen::Vector3d::Zero(), on_proxy = Eigen::Vector3d::Zero();
};

// Measures proxies of one surface, whose search tree is built once. Keeps references to the
// surface and its regions.
class RegionMeter {
 public:
  RegionMeter(const TriangleMesh& surface, const ThicknessRegions& regions)
      : surface_(surface), regions_(regions), scene_(surface) {}
  const RayScene& scene() const { return scene_; }  // of the surface
  RegionErrors measure(const TriangleMesh& proxy, const RunContext& context = {}) const;
  // For each face of the proxy the farthest point found among the surface's vertices and a lattice
  // on the face; share 0 where no thickness is known.
  std::vector<FarPoint> far_points(const TriangleMesh& proxy, const RunContext& context = {}) const;

 private:
  double share_at(std::uint32_t surface_face, double distance_mm) const {
    return distance_mm / regions_.thickness_mm[regions_.of_face[surface_face]];
  }

  const TriangleMesh& surface_;
  const ThicknessRegions& regions_;
  RayScene scene_;
};

}  // namespace organbake
