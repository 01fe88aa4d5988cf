// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/player/script.h"
#include "organbake/warp/solids.h"

namespace organbake {

// The active instruments as a viewer sees them, each part with its instrument's number: a ball, a
// capsule or the blades of scissors, and a thin shaft. Where no path of the same number gives the
// shaft a direction, it leads away from the organ, that of scissors on from their pivot.
std::vector<Solid> solids_of(const std::vector<Instrument>& instruments, const Bundle& bundle,
                             const std::vector<InstrumentPath>& paths = {});

// A script's instruments with every waypoint brought to world millimetres.
class InstrumentMotion {
 public:
  // Throws BadDataError, naming the script and the key, where a direction meets no skin.
  InstrumentMotion(const Script& script, const Bundle& bundle);

  std::vector<Instrument> at(double time_s) const;  // InstrumentPath::at() of each
  std::vector<Solid> solids(const std::vector<Instrument>& instruments) const {
    return solids_of(instruments, *bundle_, paths_);
  }

 private:
  const Bundle* bundle_;
  std::vector<InstrumentPath> paths_;
};

}  // namespace organbake
