// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "organbake/instruments/instrument.h"
#include "organbake/warp/solids.h"

namespace organbake {

// How a tool is held at one moment.
struct ToolHold {
  Eigen::Vector3d trocar_mm;  // where its shaft ends, world
  // Which of the ways it could be turned about its shaft: jaws open along it, a blade's back lies
  // towards it. Of any length, not along the shaft; the same as long as the tool is held.
  Eigen::Vector3d aside;
  double open = 0;  // of jaws: 0 as they hold tissue, 1 before they close
};

// What a viewer sees of a tool: a probe's ball, a grasper's jaws, a scalpel, a hook, scissors, a
// needle in its holder, and the shaft that leads to its trocar. Always as many parts of a kind, in
// one order. They are looks alone: what touches is the instrument's tip.
std::vector<Solid> tool_parts(const Instrument& tool, const ToolHold& hold);

}  // namespace organbake
