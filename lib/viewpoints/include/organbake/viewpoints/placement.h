// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <numbers>
#include <optional>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/geometry/camera.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/geometry/view_manifold.h"

namespace organbake {

// Where a viewer may ever be: directions (organ's centre → eye) within an angle of an axis.
struct ViewingCone {
  Eigen::Vector3d axis = {0, -1, 0};  // world, any length
  double half_angle_rad = 0.5;        // 0.01…π/2 (a hemisphere); wider ones are served all round
};

// What the cameras must show of the surface. A bit of it counts as seen by a camera when nothing
// lies between, when it is seen at less than 60° from its normal, and when a texel is small enough
// on it. What no view of the region shows so is not asked for.
struct CoverageGoal {
  double share = 0.995;     // of the reachable area, 0.5…1
  int overlap = 2;          // cameras that must see it, 1…4
  double texel_mm = 0;      // longest side of a texel's footprint, 0…1000; 0 = any
  double view_gap = 0.001;  // see ViewCertificate, 0…1; 1 = not looked at
  int candidates = 1024;    // directions to choose from, 16…8192
  int samples = 6144;       // of the surface, 64…65536

  // Throws UsageError.
  void check() const;
};

// Cosine of the steepest angle at which a camera shows a surface well: 60°.
inline constexpr double kLeastSeenCosine = 0.5;
// So far outside their viewing region cameras of a coverage may stand. What viewers on its rim just
// reach, at almost 60°, only cameras beside them would see if all stood inside: that takes a ring
// of them, and more than viewers who go anywhere need. From half those 60° beyond, few see it all.
inline constexpr double kBeyondRegion_rad = std::numbers::pi / 6;
// Independent views of the region that decide what is reachable.
inline constexpr int kRegionViews = 2048;

// How much is measured of a finished placement (coverage.h).
enum class CoverageDetail { brief, full };

struct PlacementOptions {
  int count = 8;                   // 1…256
  int map_size = 512;              // pixels, square maps, 8…16384
  double field_of_view_rad = 0.6;  // of the whole map, 0.01…2.5: decides the distance
  double margin = 0.03;            // free border round the organ, share of the map, 0…0.4
  std::optional<ViewingCone> cone = std::nullopt;  // nothing = all round
  // Then `count` is not asked: as few cameras as reach the goal.
  std::optional<CoverageGoal> coverage = std::nullopt;

  // Throws UsageError.
  void check() const;
  // The cone; all round without one.
  ViewingCone region() const;
};

// How the cameras of a coverage goal were found.
struct CoverSummary {
  double lower_bound = 0;        // of their number, over all candidates; ceil() of it is meant
  std::size_t candidates = 0;    // directions that it was chosen and proved over
  std::size_t for_coverage = 0;  // cameras that the goal of coverage took
  std::size_t for_views = 0;     // more of them, so that views find all in their three cameras
  double coverage = 0;           // reached, on samples that had no part in choosing
  bool reached = false;
};

struct Placement {
  std::vector<PosedCamera> cameras;  // all look at the centre, all contain the whole organ
  ViewManifold manifold;
  TriangleMesh manifold_surface;  // the VPM itself, to look at (world mm)
  std::optional<CoverSummary> cover = std::nullopt;
};

// Evenly spread cameras round the surface or inside a cone, at one common distance, and the viewing
// projection manifold by intersection of the half-spaces behind their view planes (CGAL).
// Camera 0 looks along the cone's axis, or from the patient's front (−y); image-up is
// +z, or what up_from() says of the axis. Two or
// three cameras in a cone all stand on its rim, for with one on the axis they would span no
// triangle. The common distance is the least at which every vertex lies inside every map; each
// camera's focal length is then raised until the organ fills its map. Throws BadDataError for a
// surface without extent.
Placement place_cameras(const TriangleMesh& surface, const PlacementOptions& options,
                        const RunContext& context = {});

// The cameras of given unit directions and distance, with their VPM.
class OrganFrame;
Placement placement_of(const OrganFrame& organ, const std::vector<Eigen::Vector3d>& directions,
                       double distance_mm, const PlacementOptions& options);

// The VPM of given directions at one common distance; bounded by a box when the cameras do not
// surround the centre; vertices of more than three planes are fanned from their lowest camera.
// Fills placement.manifold and placement.manifold_surface. Triangles run counter-clockwise seen
// from outside, start at their lowest camera and are sorted; there are none for fewer than three
// cameras or for cameras that all lie in one plane with the centre. Throws BadDataError when an
// eye is at the centre, not finite, or in the same direction as another.
void build_view_manifold(const Eigen::Vector3d& center, const std::vector<Eigen::Vector3d>& eyes,
                         Placement& placement);

}  // namespace organbake
