// SPDX-License-Identifier: Apache-2.0
#include "organbake/player/instrument_motion.h"

#include <algorithm>
#include <string>

#include "organbake/core/error.h"
#include "organbake/player/skin_point.h"

namespace organbake {
namespace {

// The ball's foremost point, not its centre, is at the depth.
Eigen::Vector3d tip_at_depth(const Waypoint& waypoint, double radius_mm, const Bundle& bundle) {
  const Eigen::Vector3d outward = waypoint.direction.normalized();
  return skin_point(bundle, outward) + (radius_mm - waypoint.depth_mm) * outward;
}

// Where a script's direction stands, before what is wrong with it.
std::string place_of(const Script& script, std::size_t instrument, std::size_t waypoint) {
  return "script '" + script.name + "': /instruments/" + std::to_string(instrument) + "/path/" +
         std::to_string(waypoint) + "/direction: ";
}

}  // namespace

InstrumentMotion::InstrumentMotion(const Script& script, const Bundle& bundle) : bundle_(&bundle) {
  for (const InstrumentPath& instrument : script.instruments) {
    Path path;
    path.tip.radius_mm =
        instrument.radius_mm > 0 ? instrument.radius_mm : bundle.mechanics.instrument_radius_mm;
    path.tip.mode = instrument.mode;
    path.tip.axis_mm = instrument.axis_mm;
    path.tip.cut_width_mm = instrument.cut_width_mm;
    path.shaft = instrument.shaft;
    path.opens_along = instrument.opens_along.normalized();
    for (const Waypoint& waypoint : instrument.path) {
      path.times.push_back(waypoint.time_s);
      path.openings_mm.push_back(waypoint.opening_mm);
      if (waypoint.position_mm) {
        path.positions.push_back(*waypoint.position_mm);
        continue;
      }
      try {
        path.positions.push_back(tip_at_depth(waypoint, path.tip.radius_mm, bundle));
      } catch (const BadDataError& error) {
        throw BadDataError(place_of(script, paths_.size(), path.positions.size()) + error.what());
      }
    }
    paths_.push_back(std::move(path));
  }
}

std::vector<InstrumentTip> InstrumentMotion::tips_at(double time_s) const {
  std::vector<InstrumentTip> tips;
  for (const Path& path : paths_) {
    InstrumentTip tip = path.tip;
    tip.position_mm = path.positions.front();
    const auto next = std::upper_bound(path.times.begin(), path.times.end(), time_s);
    if (next == path.times.end()) tip.position_mm = path.positions.back();
    if (next != path.times.begin() && next != path.times.end()) {
      const std::size_t i = next - path.times.begin();
      const double t = (time_s - path.times[i - 1]) / (path.times[i] - path.times[i - 1]);
      tip.position_mm = (1 - t) * path.positions[i - 1] + t * path.positions[i];
      const double opening_mm = (1 - t) * path.openings_mm[i - 1] + t * path.openings_mm[i];
      tip.opening_mm = opening_mm * path.opens_along;
      tip.active = true;
    }
    tips.push_back(tip);
  }
  return tips;
}

std::vector<Solid> InstrumentMotion::solids(const std::vector<InstrumentTip>& tips) const {
  std::vector<Solid> solids;
  for (std::size_t i = 0; i < tips.size(); ++i) {
    if (!tips[i].active) continue;
    std::vector<Solid> tool = tool_solids(tips[i], paths_[i].shaft, *bundle_);
    for (Solid& part : tool) part.instrument = static_cast<std::uint32_t>(i);
    solids.insert(solids.end(), tool.begin(), tool.end());
  }
  return solids;
}

std::vector<Solid> tool_solids(const InstrumentTip& tip,
                               const std::optional<Eigen::Vector3d>& shaft, const Bundle& bundle) {
  const Eigen::Vector3d outward = tip.position_mm - bundle.cameras.manifold.center_world_mm;
  const bool along_axis = tip.mode == InstrumentMode::snip || tip.mode == InstrumentMode::pierce;
  const Eigen::Vector3d along = shaft.value_or(along_axis ? tip.axis_mm : outward).normalized();
  const Eigen::Vector3d end = tip.position_mm + tip.axis_mm;
  const double length_mm = bounds(bundle.proxy).diagonal();
  const Eigen::Vector3f steel = Eigen::Vector3f::Constant(0.35f),
                        dark_steel = Eigen::Vector3f::Constant(0.2f);
  if (tip.mode == InstrumentMode::snip) {
    return {{tip.position_mm - 0.5 * tip.opening_mm, end, tip.radius_mm, steel},
            {tip.position_mm + 0.5 * tip.opening_mm, end, tip.radius_mm, steel},
            {end, end + length_mm * along, 1.5 * tip.radius_mm, dark_steel}};
  }
  if (tip.mode == InstrumentMode::pierce) {
    return {{tip.position_mm, end, tip.radius_mm, steel},
            {end, end + length_mm * along, 3 * tip.radius_mm, dark_steel}};
  }
  return {{tip.position_mm, tip.position_mm + tip.axis_mm, tip.radius_mm, steel},
          {tip.position_mm, tip.position_mm + length_mm * along, 0.4 * tip.radius_mm, dark_steel}};
}

}  // namespace organbake
