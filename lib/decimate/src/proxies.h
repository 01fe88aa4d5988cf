// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// What decimate() is made of: how far a proxy is off where the surface is thin, and more vertices
// there, until it serves.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/raycast/ray_scene.h"

namespace organbake {

struct DecimateOptions;

// Gives vertices with hundreds of faces, such as the middle of a cap or the tip of a cone, fewer:
// spokes become edges between the spokes beside them, where no face turns by more than 60°. The
// mesh must be manifold; it stays so, with as many faces. Throws BadDataError where thousands stay.
void split_hubs(TriangleMesh& mesh);

// A body's parts that are thick each in its own way: an organ, and the vessels that leave it.
struct ThicknessRegions {
  std::vector<double> thickness_mm;    // of each; none where the surface has a border
  std::vector<std::uint32_t> of_face;  // the region of each face of the surface
};

// Thickness is 2 · volume / area: a plate's own, a long tube's radius, two thirds of a ball's. Its
// local form is half the mean chord through the body from a point of the surface, directions
// weighted by their cosine; over the whole surface that is 2 · volume / area again (Cauchy's
// formula, Santaló 1976). Each connected surface is a region; where a connected part of a region
// is less than half as thick as the region, and longer than wide, it is one of its own. The same
// for any number of threads.
ThicknessRegions thickness_regions(const TriangleMesh& surface, const RunContext& context = {});

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

// A proxy of at most `faces` by the method of the options. The surface must be
// manifold (manifold_faces()).
TriangleMesh proxy_with_faces(const TriangleMesh& surface, const DecimateOptions& options,
                              std::size_t faces, const RunContext& context = {});

// A proxy, and what the meter says of it.
struct MeasuredProxy {
  TriangleMesh mesh;
  RegionErrors errors = {};
};

// Where a few places of the first proxy lie off by more than options.max_share of the thickness,
// vertices are added there, each fitted with its neighbours; where it is too coarse as a whole,
// more faces are asked for, and the largest distance is what is lowered. The nearest of those
// tried, with options.most_faces at most. The surface must be the first proxy's and the meter's.
MeasuredProxy serving_proxy(const TriangleMesh& surface, TriangleMesh first,
                            const RegionMeter& meter, const DecimateOptions& options,
                            const RunContext& context = {});

}  // namespace organbake
