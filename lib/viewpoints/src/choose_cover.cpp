// SPDX-License-Identifier: GPL-3.0-or-later
#include "choose_cover.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#include "sample_counts.h"

namespace organbake {
namespace {

// What one more candidate gains: samples that it completes, and a quarter for those that it brings
// nearer.
std::size_t gain(const SampleBits& seen, const SampleCounts& counts) {
  return count_common(seen, counts.lacking()) + 3 * count_common(seen, counts.next());
}

}  // namespace

ChosenCover greedy_cover(const CandidateSights& seen, ChosenCover cover, const CoverGoal& goal,
                         std::size_t most) {
  if (seen.empty()) return cover;
  const std::size_t samples = seen[0].size();
  most = std::min(most, seen.size());
  SampleCounts counts(samples, goal.overlap, std::max(most, cover.chosen.size()));
  std::vector<bool> taken(seen.size(), false);
  const auto take = [&](std::uint32_t c) {
    counts.add(seen[c]);
    taken[c] = true;
    cover.covered = samples - counts.lacking_count();
  };
  cover.covered = 0;
  for (const std::uint32_t c : cover.chosen) take(c);
  std::vector<std::size_t> gains(seen.size());
  while (cover.covered < goal.samples && cover.chosen.size() < most) {
    constexpr std::size_t kGrain = 128;
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, seen.size(), kGrain),
                      [&](const auto& range) {
                        for (std::size_t c = range.begin(); c < range.end(); ++c)
                          gains[c] = taken[c] ? 0 : gain(seen[c], counts);
                      });
    const auto best = std::max_element(gains.begin(), gains.end());
    if (*best == 0) break;
    const auto c = static_cast<std::uint32_t>(best - gains.begin());
    take(c);
    cover.chosen.push_back(c);
  }
  std::sort(cover.chosen.begin(), cover.chosen.end());
  return cover;
}

}  // namespace organbake
