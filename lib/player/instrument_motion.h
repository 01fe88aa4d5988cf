// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "bundle/bundle.h"
#include "player/script.h"
#include "warp/solids.h"

namespace organbake {

// A script's instruments with every waypoint brought to world millimetres.
class InstrumentMotion {
 public:
  InstrumentMotion(const Script& script, const Bundle& bundle);

  // The tips at a time: linear between waypoints, inactive before the first and after the last.
  std::vector<InstrumentTip> tips_at(double time_s) const;

 private:
  struct Path {
    double radius_mm;
    InstrumentMode mode;
    std::vector<double> times;
    std::vector<Eigen::Vector3d> positions;
  };
  std::vector<Path> paths_;
};

// What a viewer sees of the active tips: a ball and a thin shaft that leads away from the organ.
std::vector<Solid> tool_solids(const std::vector<InstrumentTip>& tips, const Bundle& bundle);

}  // namespace organbake
