// SPDX-License-Identifier: Apache-2.0
// A script's tool paths in world millimetres: depths below the skin become places, by the skin of
// the organ at rest.
#include "organbake/player/instrument_motion.h"

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

InstrumentMotion::InstrumentMotion(const Script& script, const Bundle& bundle)
    : paths_(script.instruments) {
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

}  // namespace organbake
