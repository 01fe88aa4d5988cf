// SPDX-License-Identifier: Apache-2.0
#include "organbake/cutting/blade_sweeps.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace organbake {
namespace {

// Elements stand out of the skin by no more than their size.
constexpr double kReachPerEdge = 1.5;
// A hole that is narrower would not show, and take very small faces.
constexpr double kLeastHoleRadius_mm = 0.3;
constexpr double kHoleDepth_mm = 6;
constexpr double kAboveSkin_mm = 3;

}  // namespace

void BladeSweeps::advance(std::span<const CuttingStep> steps, const CutOrgan& organ,
                          const std::vector<Eigen::Vector3d>& nodes_mm) {
  for (auto& [instrument, path] : paths_) {
    if (std::none_of(steps.begin(), steps.end(),
                     [&, i = instrument](const CuttingStep& s) { return s.instrument == i; }))
      path.lift();
  }
  if (steps.empty()) return;
  const PosedBody posed(organ.body(), nodes_mm);
  const double reach_mm = kReachPerEdge * organ.body().mean_edge_mm();
  for (const CuttingStep& now : steps) {
    BladePath& path = paths_[now.instrument];
    const auto advance = [&](const CuttingEdge& to) {
      path.advance(to, {now.width_mm}, posed, organ.inside(), reach_mm, sheet_);
    };
    if (now.put_down) path.lift(), advance(*now.put_down);
    advance(now.edge);
  }
}

// A blade that passes from one side of the needle to the other, and takes away as much across.
void BladeSweeps::pierce(const Eigen::Vector3d& at_mm, const Eigen::Vector3d& up_needle,
                         double radius_mm, const CutOrgan& organ,
                         const std::vector<Eigen::Vector3d>& nodes_mm) {
  const double radius = std::max(radius_mm, kLeastHoleRadius_mm);
  const Eigen::Vector3d aside = radius * up_needle.unitOrthogonal();
  const PosedBody posed(organ.body(), nodes_mm);
  const double reach_mm = kReachPerEdge * organ.body().mean_edge_mm();
  BladePath path;
  for (const double side : {-1.0, 1.0}) {
    const Eigen::Vector3d at = at_mm + side * aside;
    path.advance({at - kHoleDepth_mm * up_needle, at + kAboveSkin_mm * up_needle},
                 {2 * radius, radius}, posed, organ.inside(), reach_mm, sheet_);
  }
}

}  // namespace organbake
