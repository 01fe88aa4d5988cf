// SPDX-License-Identifier: Apache-2.0
#include "player/instrument_motion.h"

#include <algorithm>

#include "player/skin_point.h"

namespace organbake {

InstrumentMotion::InstrumentMotion(const Script& script, const Bundle& bundle) {
  for (const InstrumentPath& instrument : script.instruments) {
    Path path{
        instrument.radius_mm > 0 ? instrument.radius_mm : bundle.mechanics.instrument_radius_mm,
        instrument.mode,
        {},
        {}};
    for (const Waypoint& waypoint : instrument.path) {
      path.times.push_back(waypoint.time_s);
      if (waypoint.position_mm) {
        path.positions.push_back(*waypoint.position_mm);
        continue;
      }
      // The ball's foremost point, not its centre, is at the depth.
      const Eigen::Vector3d outward = waypoint.direction.normalized();
      path.positions.push_back(skin_point(bundle, outward) +
                               (path.radius_mm - waypoint.depth_mm) * outward);
    }
    paths_.push_back(std::move(path));
  }
}

std::vector<InstrumentTip> InstrumentMotion::tips_at(double time_s) const {
  std::vector<InstrumentTip> tips;
  for (const Path& path : paths_) {
    InstrumentTip tip{path.positions.front(), path.radius_mm, path.mode, false};
    const auto next = std::upper_bound(path.times.begin(), path.times.end(), time_s);
    if (next == path.times.end()) tip.position_mm = path.positions.back();
    if (next != path.times.begin() && next != path.times.end()) {
      const std::size_t i = next - path.times.begin();
      const double t = (time_s - path.times[i - 1]) / (path.times[i] - path.times[i - 1]);
      tip.position_mm = (1 - t) * path.positions[i - 1] + t * path.positions[i];
      tip.active = true;
    }
    tips.push_back(tip);
  }
  return tips;
}

std::vector<Solid> tool_solids(const std::vector<InstrumentTip>& tips, const Bundle& bundle) {
  const Eigen::Vector3d center = bundle.cameras.manifold.center_world_mm;
  const double shaft_mm = bounds(bundle.proxy).diagonal();
  std::vector<Solid> solids;
  for (const InstrumentTip& tip : tips) {
    if (!tip.active) continue;
    const Eigen::Vector3d away = (tip.position_mm - center).normalized();
    const Eigen::Vector3f steel = Eigen::Vector3f::Constant(0.35f),
                          dark_steel = Eigen::Vector3f::Constant(0.2f);
    solids.push_back({tip.position_mm, tip.position_mm, tip.radius_mm, steel});
    solids.push_back(
        {tip.position_mm, tip.position_mm + shaft_mm * away, 0.4 * tip.radius_mm, dark_steel});
  }
  return solids;
}

}  // namespace organbake
