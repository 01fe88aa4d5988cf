// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "organbake/geometry/view_manifold.h"
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

}  // namespace organbake
