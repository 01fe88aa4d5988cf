// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/viewpoints/placement.h"
#include "organbake/viewpoints/sight.h"

namespace organbake {

// What viewers miss: the surface visible in a view but to none of the three cameras that the VPM
// gives it.
struct ViewCertificate {
  int views = 0;
  // Share of what the view shows, by the area that it has in the picture: the mean of all views and
  // the worst one.
  double mean_gap = 0, worst_gap = 0;
  // The same, by area on the surface: slivers at the outline, which hardly show, count fully.
  double mean_surface_gap = 0;
  std::vector<double> gaps;  // of each view
};

// `seen[v]`: samples visible from views_mm[v], at any angle. `kept[c]`: samples that camera c has.
// `samples` as they lie in the views (poked, perhaps); cameras may have been at rest.
ViewCertificate certify_views(const ViewManifold& manifold, const std::vector<SampleBits>& kept,
                              const std::vector<Eigen::Vector3d>& views_mm,
                              const std::vector<SampleBits>& seen, const SurfaceSamples& samples);

// What the cameras of a placement show of the surface, measured on samples and views of its own.
struct CoverageReport {
  // Of the surface's area: what some of 2,048 views of the region shows well (as CoverageGoal
  // says), and what none shows at any angle.
  double reachable_share = 0, hidden_share = 0;
  // Of the reachable area: seen well by at least one, two, three cameras.
  std::array<double, 3> seen_share = {};
  // Of the area seen: the longest side of the finest texel on it. Bin k reaches from edge k − 1 to
  // edge k; the last one is open.
  static constexpr std::array<double, 7> kTexelEdges_mm = {0.0625, 0.125, 0.25, 0.5, 1, 2, 4};
  std::array<double, kTexelEdges_mm.size() + 1> texel_share = {};
  double median_texel_mm = 0;
  ViewCertificate at_rest;
  // Views of the surface poked by 10, 20 and 30 % of its size, cameras as they were at rest.
  struct Poked {
    double depth_mm = 0;
    ViewCertificate certificate;
    // Of what the views reach of the poked surface: seen at rest by at least one, two, three.
    std::array<double, 3> seen_share = {};
  };
  std::vector<Poked> poked;
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

// The surface, a colour a vertex by how many of the cameras show it well: red = none, yellow = one,
// green = two, blue = three or more; grey = none of the region's views does.
TriangleMesh painted_by_cameras(const TriangleMesh& surface, const Sight& sight,
                                const std::vector<Eye>& cameras, const std::vector<Eye>& region,
                                const SightLimits& well);

// A push on the surface: everything moves along `displacement_mm`, by exp(−r²/2σ²) of it at the
// distance r from the site. Smooth and without folds for σ > 0.61 |displacement|.
struct Poke {
  Eigen::Vector3d site_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d displacement_mm = Eigen::Vector3d::Zero();
  double sigma_mm = 1;
};

TriangleMesh poked_surface(TriangleMesh surface, const Poke& poke);

}  // namespace organbake
