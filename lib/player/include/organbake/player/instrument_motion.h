// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/player/script.h"
#include "organbake/warp/solids.h"

namespace organbake {

// A script's instruments with every waypoint brought to world millimetres.
class InstrumentMotion {
 public:
  // Throws BadDataError, naming the script and the key, where a direction meets no skin.
  InstrumentMotion(const Script& script, const Bundle& bundle);

  std::vector<Instrument> at(double time_s) const;  // InstrumentPath::at() of each
  // What a viewer sees of the active ones, each part with its instrument's number.
  std::vector<Solid> solids(const std::vector<Instrument>& instruments) const;

 private:
  const Bundle* bundle_;
  std::vector<InstrumentPath> paths_;
};

// An instrument as a viewer sees it: a ball, a capsule or the blades of scissors, and a thin shaft;
// without a direction it leads away from the organ, that of scissors on from their pivot.
std::vector<Solid> tool_solids(const Instrument& instrument,
                               const std::optional<Eigen::Vector3d>& shaft, const Bundle& bundle);

}  // namespace organbake
