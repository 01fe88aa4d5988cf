// SPDX-License-Identifier: Apache-2.0
#include "organbake/instruments/instrument_sweep.h"

#include <algorithm>
#include <variant>

namespace organbake {

namespace {

// What key frames that hold a tool still differ by from step to step, in rounding, is less.
constexpr double kSame_mm = 1e-9;

bool same(const Instrument& a, Instrument b) {
  const auto near = [](const Eigen::Vector3d& p, const Eigen::Vector3d& q) {
    return (p - q).norm() <= kSame_mm;
  };
  if (near(a.position_mm, b.position_mm)) b.position_mm = a.position_mm;
  const Scissors* const of_a = std::get_if<Scissors>(&a.kind);
  Scissors* const of_b = std::get_if<Scissors>(&b.kind);
  if (of_a && of_b && near(of_a->opening_mm, of_b->opening_mm)) of_b->opening_mm = of_a->opening_mm;
  return a == b;
}

}  // namespace

bool unchanged(const std::vector<Instrument>& before, const std::vector<Instrument>& now) {
  const Instrument absent;
  for (std::size_t i = 0; i < std::max(before.size(), now.size()); ++i) {
    const Instrument& a = i < before.size() ? before[i] : absent;
    const Instrument& b = i < now.size() ? now[i] : absent;
    if ((a.active || b.active) && !same(a, b)) return false;
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
