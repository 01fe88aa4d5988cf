// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/run_context.h"
#include "geometry/camera.h"
#include "geometry/triangle_mesh.h"
#include "geometry/view_manifold.h"

namespace organbake {

// Where a viewer may ever be: directions (organ's centre → eye) within an angle of an axis.
struct ViewingCone {
  Eigen::Vector3d axis = {0, -1, 0};  // world, any length
  double half_angle_rad = 0.5;        // 0.01…1.5; wider regions are better served all round
};

struct PlacementOptions {
  int count = 8;                   // 1…256
  int map_size = 512;              // pixels, square maps, 8…16384
  double field_of_view_rad = 0.6;  // of the whole map, 0.01…2.5: decides the distance
  double margin = 0.03;            // free border round the organ, share of the map, 0…0.4
  std::optional<ViewingCone> cone = std::nullopt;  // nothing = all round

  // Throws UsageError.
  void check() const;
};

struct Placement {
  std::vector<PosedCamera> cameras;  // all look at the centre, all contain the whole organ
  ViewManifold manifold;
  TriangleMesh manifold_surface;  // the VPM itself, to look at (world mm)
};

// Evenly spread cameras round the surface or inside a cone, at one common distance, and the viewing
// projection manifold by intersection of the half-spaces behind their view planes (CGAL).
// Camera 0 looks along the cone's axis, or from the patient's front (−y); image-up is +z. Two or
// three cameras in a cone all stand on its rim, for with one on the axis they would span no
// triangle. The common distance is the least at which every vertex lies inside every map; each
// camera's focal length is then raised until the organ fills its map. Throws BadDataError for a
// surface without extent.
Placement place_cameras(const TriangleMesh& surface, const PlacementOptions& options,
                        const RunContext& context = {});

// The VPM of given directions at one common distance; bounded by a box when the cameras do not
// surround the centre; vertices of more than three planes are fanned from their lowest camera.
// Fills placement.manifold and placement.manifold_surface. Triangles run counter-clockwise seen
// from outside, start at their lowest camera and are sorted; there are none for fewer than three
// cameras or for cameras that all lie in one plane with the centre. Throws BadDataError when an
// eye is at the centre, not finite, or in the same direction as another.
void build_view_manifold(const Eigen::Vector3d& center, const std::vector<Eigen::Vector3d>& eyes,
                         Placement& placement);

}  // namespace organbake
