// SPDX-License-Identifier: Apache-2.0
#include "organbake/instruments/instrument_sweep.h"

#include <algorithm>

namespace organbake {

bool unchanged(const std::vector<Instrument>& before, const std::vector<Instrument>& now) {
  const Instrument absent;
  for (std::size_t i = 0; i < std::max(before.size(), now.size()); ++i) {
    const Instrument& a = i < before.size() ? before[i] : absent;
    const Instrument& b = i < now.size() ? now[i] : absent;
    if ((a.active || b.active) && !(a == b)) return false;
  }
  return true;
}

std::vector<InstrumentSweep> sweeps_between(const std::vector<Instrument>& before,
                                            const std::vector<Instrument>& now) {
  std::vector<InstrumentSweep> sweeps;
  for (std::size_t i = 0; i < now.size(); ++i) {
    if (!now[i].active) continue;
    const bool goes_on =
        i < before.size() && before[i].active && before[i].kind.index() == now[i].kind.index();
    sweeps.push_back(
        {static_cast<std::uint32_t>(i), goes_on ? before[i] : now[i], now[i], !goes_on});
  }
  return sweeps;
}

}  // namespace organbake
