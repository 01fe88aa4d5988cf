// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
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
  double share = 0.995;   // of the reachable area, 0.5…1
  int overlap = 2;        // cameras that must see it, 1…4
  double texel_mm = 0;    // longest side of a texel's footprint, 0…1000; 0 = any
  int candidates = 1024;  // directions to choose from, 16…8192
  int samples = 6144;     // of the surface, 64…65536

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
  std::size_t for_coverage = 0;  // cameras that the goal of coverage took
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

// What viewers miss: the surface visible in a view but to none of the three cameras that the VPM
// gives it.
struct ViewCertificate {
  // Share of what each view shows, by the area that it has in the picture, and the mean of all.
  std::vector<double> gaps;
  double mean_gap = 0;
};

// What the cameras of a placement show of the surface, measured on samples and views of its own.
struct CoverageReport {
  // Of the surface's area: what some of 2,048 views of the region shows well (as CoverageGoal
  // says), and what none shows at any angle.
  double reachable_share = 0, hidden_share = 0;
  // Of the reachable area: seen well by at least one, two, three cameras.
  std::array<double, 3> seen_share = {};
  double median_texel_mm = 0;  // of the area seen: the longest side of the finest texel on it
  ViewCertificate at_rest;
  // Views of the surface poked by 10, 20 and 30 % of its size, cameras as they were at rest.
  std::vector<ViewCertificate> poked;
  // The surface, a colour a vertex: grey = no view of the region shows it well, red = no camera
  // does though a view would, yellow = one, green = two, blue = three or more.
  TriangleMesh painted;
};

// Brief: the shares and the texels alone, from a quarter of the samples and of the region's views;
// `at_rest`, `poked` and `painted` stay empty. It takes a tiny part of the time of the full report.
// The region and the texel limit (options.coverage, if any) are those of the placement. Throws
// BadDataError for a surface without area.
CoverageReport measure_coverage(const TriangleMesh& surface, const Placement& placement,
                                const PlacementOptions& options,
                                CoverageDetail detail = CoverageDetail::full,
                                const RunContext& context = {});

// A push on the surface: everything moves along `displacement_mm`, by exp(−r²/2σ²) of it at the
// distance r from the site. Smooth and without folds for σ > 0.61 |displacement|.
struct Poke {
  Eigen::Vector3d site_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d displacement_mm = Eigen::Vector3d::Zero();
  double sigma_mm = 1;
};

TriangleMesh poked_surface(TriangleMesh surface, const Poke& poke);

}  // namespace organbake
