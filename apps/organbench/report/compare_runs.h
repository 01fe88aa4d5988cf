// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "report/run_report.h"

namespace organbake {

// What became of one point or figure from one run to the next.
struct Change {
  enum class Kind { same, better, worse };

  std::string what;
  double before = 0, after = 0;
  Kind kind = Kind::same;
};

struct Comparison {
  std::vector<Change> changes;        // of everything that both runs hold
  std::vector<std::string> only_one;  // what one of them lacks
  bool regressed() const;
};

// Times count as changed when the spreads of the two runs don't touch and the medians differ by
// more than 5 %; errors when they differ by more than 1 %; both relative to the earlier run.
Comparison compare_runs(const RunReport& before, const RunReport& after);

}  // namespace organbake
