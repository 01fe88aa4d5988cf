// SPDX-License-Identifier: Apache-2.0
// Straight lines between waypoints, not splines: a recording has a waypoint for every step, and
// must repeat it to the last bit.
#include "organbake/instruments/instrument_path.h"

#include <algorithm>

namespace organbake {

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

}  // namespace organbake
