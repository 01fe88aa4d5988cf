// SPDX-License-Identifier: Apache-2.0
// Checks instruments, and follows them along their key frames and from one step to the next as the
// sweeps that contacts and cuts are found by.
#include "organbake/instruments/instrument.h"

#include <algorithm>

#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/geometry/rigid_transform.h"

namespace organbake {
namespace {

std::string describe(const Eigen::Vector3d& p) {
  return "(" + to_text(p.x()) + ", " + to_text(p.y()) + ", " + to_text(p.z()) + ")";
}

void check_sharp(const Instrument& instrument, const std::string& name) {
  if (!(instrument.axis_mm.norm() >= kShortestBlade_mm)) {
    throw UsageError(name + " cuts or pierces and has the axis " + describe(instrument.axis_mm) +
                     " mm; give its blade's edge or its needle, from the tip to the upper end, or "
                     "from the tips of scissors to their pivot, of 0.1 mm at least");
  }
  const Scissors* scissors = std::get_if<Scissors>(&instrument.kind);
  if (scissors && !within_reach(scissors->opening_mm)) {
    throw UsageError(name + " has the opening " + describe(scissors->opening_mm) +
                     " mm; give a finite one within 1e9 mm, zero for closed scissors");
  }
}

void check_numbers(const InstrumentKind& kind, const std::string& name) {
  const auto check = [&](const InstrumentNumber& number, double value) {
    if (value >= number.least && value <= number.most) return;
    throw UsageError(name + " has " + number.name + " " + to_text(value) + "; it must be " +
                     to_text(number.least) + " to " + to_text(number.most));
  };
  each_number_of(kind, check);
}

}  // namespace

const std::array<InstrumentKind, std::variant_size_v<InstrumentKind>>& instrument_kinds() {
  static const std::array<InstrumentKind, std::variant_size_v<InstrumentKind>> kinds = {
      Ball{}, Grasper{}, Blade{}, Scissors{}, Needle{}};
  return kinds;
}

std::optional<InstrumentKind> kind_of_mode(std::string_view mode) {
  for (const InstrumentKind& kind : instrument_kinds())
    if (mode == mode_of(kind)) return kind;
  return std::nullopt;
}

void check_instruments(const std::vector<Instrument>& instruments) {
  if (instruments.size() > kMostInstruments) {
    throw UsageError("there are " + std::to_string(instruments.size()) + " instrument tips; " +
                     std::to_string(kMostInstruments) + " at most are followed");
  }
  for (std::size_t i = 0; i < instruments.size(); ++i) {
    const Instrument& instrument = instruments[i];
    if (!instrument.active) continue;
    const std::string name = "instrument tip " + std::to_string(i);
    if (!within_reach(instrument.position_mm)) {
      throw UsageError(name + " is at " + describe(instrument.position_mm) +
                       " mm; give a finite position within 1e9 mm");
    }
    if (!within_reach(instrument.axis_mm)) {
      throw UsageError(name + " has the axis " + describe(instrument.axis_mm) +
                       " mm; give a finite one within 1e9 mm, zero for a sphere");
    }
    if (!(instrument.radius_mm >= kThinnestTip_mm) || instrument.radius_mm > kFarthest_mm) {
      throw UsageError(name + " has radius " + to_text(instrument.radius_mm) + " mm; it must be " +
                       to_text(kThinnestTip_mm) + " to 1e9");
    }
    if (!instrument.is_blunt()) check_sharp(instrument, name);
    check_numbers(instrument.kind, name);
  }
}

// Straight lines between waypoints, not splines: a recording has a waypoint for every step, and
// must repeat it to the last bit.

Instrument InstrumentPath::at(double time_s) const {
  Instrument now = instrument;
  Scissors* scissors = std::get_if<Scissors>(&now.kind);
  const auto next = std::upper_bound(path.begin(), path.end(), time_s,
                                     [](double t, const Waypoint& w) { return t < w.time_s; });
  now.active = next != path.begin() && next != path.end();
  if (!now.active) {
    now.position_mm = *(next == path.end() ? path.back() : path.front()).position_mm;
    if (scissors) scissors->opening_mm.setZero();
    return now;
  }
  const Waypoint &a = next[-1], &b = *next;
  const double t = (time_s - a.time_s) / (b.time_s - a.time_s);
  now.position_mm = (1 - t) * *a.position_mm + t * *b.position_mm;
  const double opening_mm = (1 - t) * a.opening_mm + t * b.opening_mm;
  if (scissors) scissors->opening_mm = opening_mm * scissors->opening_mm.normalized();
  return now;
}

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
