// SPDX-License-Identifier: Apache-2.0
#include "organbake/player/instrument_motion.h"

#include <optional>
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

std::vector<Solid> parts_of(const Instrument& instrument,
                            const std::optional<Eigen::Vector3d>& shaft, const Bundle& bundle) {
  const Eigen::Vector3d &tip = instrument.position_mm, end = instrument.end_mm();
  const Eigen::Vector3d outward = tip - bundle.cameras.manifold.center_world_mm;
  const Scissors* scissors = std::get_if<Scissors>(&instrument.kind);
  const bool along_axis = scissors || instrument.is<Needle>();
  const Eigen::Vector3d along =
      shaft.value_or(along_axis ? instrument.axis_mm : outward).normalized();
  const double length_mm = bounds(bundle.proxy).diagonal(), radius_mm = instrument.radius_mm;
  const Eigen::Vector3f steel = Eigen::Vector3f::Constant(0.35f),
                        dark_steel = Eigen::Vector3f::Constant(0.2f);
  if (scissors) {
    return {{tip - 0.5 * scissors->opening_mm, end, radius_mm, steel},
            {tip + 0.5 * scissors->opening_mm, end, radius_mm, steel},
            {end, end + length_mm * along, 1.5 * radius_mm, dark_steel}};
  }
  if (instrument.is<Needle>()) {
    return {{tip, end, radius_mm, steel},
            {end, end + length_mm * along, 3 * radius_mm, dark_steel}};
  }
  return {{tip, end, radius_mm, steel},
          {tip, tip + length_mm * along, 0.4 * radius_mm, dark_steel}};
}

}  // namespace

InstrumentMotion::InstrumentMotion(const Script& script, const Bundle& bundle)
    : bundle_(&bundle), paths_(script.instruments) {
  for (std::size_t i = 0; i < paths_.size(); ++i) {
    double& radius_mm = paths_[i].instrument.radius_mm;
    if (!(radius_mm > 0)) radius_mm = bundle.mechanics.instrument_radius_mm;
    for (std::size_t w = 0; w < paths_[i].path.size(); ++w) {
      Waypoint& waypoint = paths_[i].path[w];
      if (waypoint.position_mm) continue;
      try {
        waypoint.position_mm = tip_at_depth(waypoint, radius_mm, bundle);
      } catch (const BadDataError& error) {
        throw BadDataError(place_of(script, i, w) + error.what());
      }
    }
  }
}

std::vector<Instrument> InstrumentMotion::at(double time_s) const {
  std::vector<Instrument> instruments;
  for (const InstrumentPath& path : paths_) instruments.push_back(path.at(time_s));
  return instruments;
}

std::vector<Solid> solids_of(const std::vector<Instrument>& instruments, const Bundle& bundle,
                             const std::vector<InstrumentPath>& paths) {
  std::vector<Solid> solids;
  for (std::size_t i = 0; i < instruments.size(); ++i) {
    if (!instruments[i].active) continue;
    for (Solid part :
         parts_of(instruments[i], i < paths.size() ? paths[i].shaft : std::nullopt, bundle)) {
      part.instrument = static_cast<std::uint32_t>(i);
      solids.push_back(part);
    }
  }
  return solids;
}

}  // namespace organbake
