// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/viewpoints/sample_bits.h"

namespace organbake {

// What a set of cameras must do: at least `samples` samples seen by at least `overlap` of them.
struct CoverGoal {
  std::size_t samples = 0;
  int overlap = 2;
};

// Candidates, each by the samples that it sees.
using CandidateVisibility = std::vector<SampleBits>;

struct ChosenCover {
  std::vector<std::uint32_t> chosen;  // candidates, increasing
  std::size_t covered = 0;            // samples seen by at least goal.overlap of them
};

// Adds to a start always what gains most next, up to `most` candidates; fewer samples than the goal
// when they don't do. Deterministic.
[[nodiscard]] ChosenCover greedy_cover(const CandidateVisibility& seen, ChosenCover start,
                                       const CoverGoal& goal, std::size_t most);

struct Annealing {
  std::size_t moves = 1'000'000;
  // In units of one chosen candidate's share of what the goal lets go: a move by which so much more
  // is lacking is accepted one time in e, at first and in the end.
  double hot = 0.25, cold = 0.05;
};
// The fewest candidates found that reach a goal, by simulated annealing (Kirkpatrick, Gelatt and
// Vecchi 1983): one chosen candidate goes and one that sees a lacking sample comes, worse choices
// accepted less and less often; where the goal is reached, the one that is missed least goes for
// good. Where it is not, the start's number of candidates with the most samples covered.
// Deterministic. Throws CancelledError.
[[nodiscard]] ChosenCover annealed_cover(const CandidateVisibility& seen, const ChosenCover& start,
                                         const CoverGoal& goal, const Annealing& annealing,
                                         const RunContext& context = {});

}  // namespace organbake
