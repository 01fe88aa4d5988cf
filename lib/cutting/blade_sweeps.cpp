// SPDX-License-Identifier: Apache-2.0
#include "cutting/blade_sweeps.h"

#include <algorithm>

namespace organbake {
namespace {

// Elements stand out of the skin by no more than their size.
constexpr double kReachPerEdge = 1.5;

}  // namespace

void BladeSweeps::advance(std::span<const BladeNow> blades, const CutOrgan& organ,
                          const std::vector<Eigen::Vector3d>& nodes_mm) {
  for (auto& [instrument, path] : paths_) {
    if (std::none_of(blades.begin(), blades.end(),
                     [&, i = instrument](const BladeNow& b) { return b.instrument == i; }))
      path.lift();
  }
  if (blades.empty()) return;
  const PosedBody posed(organ.body(), nodes_mm);
  const double reach_mm = kReachPerEdge * organ.body().mean_edge_mm();
  for (const BladeNow& now : blades) {
    BladePath& path = paths_[now.instrument];
    const auto advance = [&](const Blade& to) {
      path.advance(to, now.width_mm, posed, organ.inside(), reach_mm, sheet_);
    };
    if (now.put_down) path.lift(), advance(*now.put_down);
    advance(now.blade);
  }
}

}  // namespace organbake
