// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace organbake {

// Of one quantity over several runs.
struct Spread {
  double median = 0, least = 0, most = 0;
};
Spread spread_of(std::vector<double> values);  // at least one value

// What it costs to do something once.
struct Timing {
  int runs = 0;
  Spread wall_ms;
  Spread cpu_ms;       // of all threads and of the programs that were run, together
  double peak_mb = 0;  // most resident memory beyond what was resident before; of the first run
};

struct Quantity {
  std::string name, unit;
  double value = 0;
};
using Quantities = std::vector<Quantity>;

// One point of a curve: what `subject` took for `task` with its knobs set so, and how wrong it was.
struct Point {
  std::string task;     // the same for all that compete: "phantom, 81,920 faces → 80"
  std::string subject;  // "organbake fitted", "CGAL Lindstrom–Turk"
  bool peer = false;    // not ours
  Quantities knobs;
  Timing timing;
  Quantities errors;  // the first is the one that is drawn
};

// A number that was promised, beside what was measured.
struct Figure {
  enum class Goal { at_most, at_least };

  std::string what;
  std::string unit;
  double value = 0;
  double target = 0;
  Goal goal = Goal::at_most;

  bool met() const { return goal == Goal::at_most ? value <= target : value >= target; }
};

struct Rounds {
  int most = 9;
  int least = 9;        // however long they take
  double budget_s = 0;  // no further round is begun after it
};

// Does the work of all competitors in turn, round after round, so that whatever else the machine
// does falls on each of them alike. A round before the first warms caches up and is not counted,
// unless it took the whole budget and one is enough.
std::vector<Timing> time_in_turn(const std::vector<std::function<void()>>& competitors,
                                 const Rounds& rounds);

}  // namespace organbake
