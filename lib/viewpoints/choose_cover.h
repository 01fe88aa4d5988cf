// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "viewpoints/cover_relaxation.h"

namespace organbake {

struct ChosenCover {
  std::vector<std::uint32_t> chosen;  // candidates, increasing
  std::size_t covered = 0;            // samples seen by at least `overlap` of them
};

// The fewest candidates found that reach a goal. Deterministic.
//
// Three starts: greedy by what each candidate adds, the candidates that the relaxation uses with
// the least missed dropped one by one, and those that it was rounded to; from the best, as long as
// it succeeds, one more is dropped and the rest repaired by swaps (a tabu search). Samples count by
// the relaxation's prices: what is hard to cover is looked after first.
class CoverSearch {
 public:
  // `seen` of one candidate each; all of the samples `among` that count.
  CoverSearch(const std::vector<SampleBits>& seen, const SampleBits& among,
              const CoverRelaxation& relaxation, int overlap);

  // At most `most` candidates, even when the goal is missed with them.
  ChosenCover fewest(const CoverGoal& goal, std::size_t most, int swaps) const;
  // A start made to reach the goal: by swaps, and by adding what gains most where they don't do.
  ChosenCover repaired(const ChosenCover& start, const CoverGoal& goal, std::size_t most,
                       int swaps) const;
  // One after the other dropped and the rest repaired, as long as that reaches the goal.
  ChosenCover thinned(ChosenCover start, const CoverGoal& goal, int swaps) const;
  // One dropped and the rest repaired; an empty cover when that misses the goal.
  ChosenCover with_one_less(const ChosenCover& start, const CoverGoal& goal, int swaps) const;

  // Always what gains most next.
  ChosenCover greedy(const CoverGoal& goal, std::size_t most) const {
    return greedy({}, goal, most);
  }

  std::size_t covered(const std::vector<std::uint32_t>& chosen) const;

 private:
  class Counts;
  ChosenCover greedy(ChosenCover start, const CoverGoal& goal, std::size_t most) const;
  // Completed where it misses the goal; then dropped one by one what is missed least.
  ChosenCover pruned(std::vector<std::uint32_t> start, const CoverGoal& goal) const;
  ChosenCover swapped(ChosenCover start, const CoverGoal& goal, int swaps) const;

  std::vector<SampleBits> seen_;  // samples reordered by price, so that a word has one weight
  std::vector<std::uint32_t> word_weights_;
  std::vector<std::uint32_t> used_, rounded_;  // by the relaxation
  int overlap_;
};

}  // namespace organbake
