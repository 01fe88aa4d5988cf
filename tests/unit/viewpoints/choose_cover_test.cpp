// SPDX-License-Identifier: GPL-3.0-or-later
#include "cover.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>

#include "organbake/core/random.h"

namespace organbake {
namespace {

constexpr Annealing kShort{.moves = 2'000};

// `groups` of `size` samples, each seen by `copies` candidates of its own.
std::vector<SampleBits> disjoint_groups(std::size_t groups, std::size_t size, int copies) {
  std::vector<SampleBits> seen;
  for (std::size_t g = 0; g < groups; ++g) {
    SampleBits bits(groups * size);
    for (std::size_t i = 0; i < size; ++i) bits.set(g * size + i);
    seen.insert(seen.end(), copies, bits);
  }
  return seen;
}

std::vector<SampleBits> random_sets(std::uint64_t seed, std::size_t candidates, std::size_t samples,
                                    double density) {
  std::vector<SampleBits> seen(candidates, SampleBits(samples));
  RandomStream random(seed);
  for (SampleBits& bits : seen) {
    for (std::size_t i = 0; i < samples; ++i) {
      if (random.uniform() < density) bits.set(i);
    }
  }
  return seen;
}

std::size_t covered_by(const std::vector<SampleBits>& seen, std::uint32_t subset, int overlap) {
  std::size_t covered = 0;
  for (std::size_t i = 0; i < seen[0].size(); ++i) {
    int times = 0;
    for (std::size_t c = 0; c < seen.size(); ++c) times += (subset >> c & 1) && seen[c].test(i);
    covered += times >= overlap;
  }
  return covered;
}

// By trying all subsets; the number of candidates + 1 when none does.
std::size_t true_fewest(const std::vector<SampleBits>& seen, const CoverGoal& goal) {
  std::size_t fewest = seen.size() + 1;
  for (std::uint32_t subset = 0; subset < (1u << seen.size()); ++subset) {
    const auto size = static_cast<std::size_t>(std::popcount(subset));
    if (size < fewest && covered_by(seen, subset, goal.overlap) >= goal.samples) fewest = size;
  }
  return fewest;
}

TEST(GreedyCover, EndsAtTheGoalOrAtTheMostAllowed) {
  const auto seen = disjoint_groups(5, 100, 1);
  const ChosenCover two = greedy_cover(seen, {}, {400, 1}, 2);
  EXPECT_EQ(two.chosen.size(), 2u);
  EXPECT_EQ(two.covered, 200u);
  const ChosenCover four = greedy_cover(seen, two, {400, 1}, 5);
  EXPECT_EQ(four.chosen.size(), 4u);
  EXPECT_EQ(four.covered, 400u);
  EXPECT_EQ(greedy_cover(seen, {}, {600, 1}, 9).chosen.size(), 5u) << "none gains any more";
  EXPECT_TRUE(greedy_cover({}, {}, {0, 1}, 9).chosen.empty());
}

TEST(AnnealedCover, FindsTheTrueFewestOfSmallSets) {
  int compared = 0;
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    const auto seen = random_sets(seed, 11, 100, 0.35);
    for (const CoverGoal& goal : {CoverGoal{85, 1}, CoverGoal{70, 2}, CoverGoal{50, 3}}) {
      const std::size_t fewest = true_fewest(seen, goal);
      if (fewest > seen.size()) continue;
      const ChosenCover cover =
          annealed_cover(seen, greedy_cover(seen, {}, goal, seen.size()), goal, kShort);
      EXPECT_GE(cover.covered, goal.samples);
      EXPECT_EQ(cover.chosen.size(), fewest) << seed;
      EXPECT_TRUE(std::is_sorted(cover.chosen.begin(), cover.chosen.end()));
      std::uint32_t subset = 0;
      for (const std::uint32_t c : cover.chosen) subset |= 1u << c;
      EXPECT_EQ(covered_by(seen, subset, goal.overlap), cover.covered);
      ++compared;
    }
  }
  EXPECT_GT(compared, 40);
}

// More candidates than a brute force could try, and greedy choices are known to be misled: of two
// halves and ever larger parts across them, it takes the parts.
TEST(AnnealedCover, LeavesAGreedyTrap) {
  constexpr int kParts = 6;
  const std::size_t half = (1u << kParts) - 1;
  std::vector<SampleBits> seen(2 + kParts, SampleBits(2 * half));
  std::size_t at = 0;
  for (int part = 0; part < kParts; ++part)
    for (std::size_t k = 0; k < (1u << part); ++k, ++at)
      for (const std::size_t side : {0, 1}) {
        seen[side].set(2 * at + side);
        seen[std::size_t(2 + part)].set(2 * at + side);
      }
  const CoverGoal all{2 * half, 1};
  const ChosenCover greedy = greedy_cover(seen, {}, all, seen.size());
  EXPECT_EQ(greedy.chosen.size(), std::size_t(kParts));
  EXPECT_EQ(annealed_cover(seen, greedy, all, {.moves = 20'000, .hot = 20}).chosen,
            (std::vector<std::uint32_t>{0, 1}));
}

TEST(AnnealedCover, KeepsTheMostCoveredWhereTheGoalIsOutOfReach) {
  const auto seen = disjoint_groups(5, 100, 2);
  const ChosenCover start{{0, 1}, 100};
  const ChosenCover cover = annealed_cover(seen, start, {400, 1}, kShort);
  EXPECT_EQ(cover.chosen.size(), 2u);
  EXPECT_EQ(cover.covered, 200u) << "not one group twice";
  EXPECT_TRUE(annealed_cover(seen, {}, {0, 1}, kShort).chosen.empty());
}

}  // namespace
}  // namespace organbake
