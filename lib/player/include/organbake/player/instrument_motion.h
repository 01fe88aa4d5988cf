// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/player/script.h"

namespace organbake {

// A script's instruments with every waypoint brought to world millimetres.
class InstrumentMotion {
 public:
  // Throws BadDataError, naming the script and the key, where a direction meets no skin.
  InstrumentMotion(const Script& script, const Bundle& bundle);

  std::vector<Instrument> at(double time_s) const;  // InstrumentPath::at() of each
  const std::vector<InstrumentPath>& paths() const { return paths_; }

 private:
  std::vector<InstrumentPath> paths_;
};

}  // namespace organbake
