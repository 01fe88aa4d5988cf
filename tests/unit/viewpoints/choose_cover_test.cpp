// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewpoints/choose_cover.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>

#include "core/random.h"
#include "viewpoints/cover_program.h"

namespace organbake {
namespace {

constexpr double kSteps = 2000;
constexpr int kSwaps = 200, kPivots = 10'000;

SampleBits all_of(std::size_t size) {
  SampleBits bits(size);
  for (std::size_t i = 0; i < size; ++i) bits.set(i);
  return bits;
}

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

TEST(RelaxCover, KnowsWhatDisjointGroupsTake) {
  const SampleBits all = all_of(500);
  const auto bound = [&](int copies, const CoverGoal& goal) {
    return relax_cover(disjoint_groups(5, 100, copies), all, goal, kSteps).lower_bound;
  };
  constexpr double kSearched = 0.02;  // how near the search for prices comes
  EXPECT_NEAR(bound(1, {500, 1}), 5, kSearched * 5);
  EXPECT_NEAR(bound(3, {500, 2}), 10, kSearched * 10);
  EXPECT_NEAR(bound(1, {450, 1}), 4.5, kSearched * 4.5);  // the relaxation takes half a group
  EXPECT_EQ(bound(1, {0, 1}), 0);
}

TEST(RelaxCover, IsNeverAboveTheTrueFewest) {
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    const auto seen = random_sets(seed, 11, 100, 0.35);
    for (const CoverGoal& goal : {CoverGoal{85, 1}, CoverGoal{70, 2}}) {
      const std::size_t fewest = true_fewest(seen, goal);
      if (fewest > seen.size()) continue;
      for (const double steps : {1., 50., kSteps}) {
        const CoverRelaxation relaxation = relax_cover(seen, all_of(100), goal, steps);
        EXPECT_LE(std::ceil(relaxation.lower_bound), fewest) << seed;
      }
    }
  }
}

TEST(SolveCover, KnowsWhatDisjointGroupsTake) {
  const auto bound = [&](int copies, const CoverGoal& goal) {
    return solve_cover(disjoint_groups(5, 100, copies), all_of(500), goal, goal.samples, kPivots)
        .lower_bound;
  };
  constexpr double kRounding = 1e-6;
  EXPECT_NEAR(bound(1, {500, 1}), 5, kRounding);
  EXPECT_NEAR(bound(3, {500, 2}), 10, kRounding);
  EXPECT_NEAR(bound(1, {450, 1}), 4.5, kRounding);
  EXPECT_EQ(bound(1, {0, 1}), 0);
}

TEST(SolveCover, IsNeverAboveTheTrueFewestAndRoundsToACover) {
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    const auto seen = random_sets(seed, 11, 100, 0.35);
    for (const CoverGoal& goal : {CoverGoal{85, 1}, CoverGoal{70, 2}, CoverGoal{50, 3}}) {
      const std::size_t fewest = true_fewest(seen, goal);
      if (fewest > seen.size()) continue;
      for (const int pivots : {0, 3, 20, kPivots}) {
        const CoverRelaxation relaxation =
            solve_cover(seen, all_of(100), goal, goal.samples, pivots);
        EXPECT_LE(std::ceil(relaxation.lower_bound), fewest) << seed;
        if (pivots < kPivots) continue;
        std::uint32_t subset = 0;
        for (const std::uint32_t c : relaxation.rounded) subset |= 1u << c;
        EXPECT_GE(covered_by(seen, subset, goal.overlap), goal.samples) << seed;
      }
    }
  }
}

// Places in folds, each seen by its own few: one candidate does not stand for two.
TEST(SolveCover, IsTighterWhereACandidateCannotCountTwice) {
  // 40 places seen by three candidates each; half of them may be given up.
  const auto seen = disjoint_groups(40, 1, 3);
  const CoverGoal goal{20, 2};
  const CoverRelaxation tight = solve_cover(seen, all_of(40), goal, goal.samples, kPivots);
  EXPECT_NEAR(tight.lower_bound, 40, 1e-6);
  EXPECT_EQ(tight.rounded.size(), 40u);
}

TEST(SolveCover, AimsAtMoreThanTheGoalItBounds) {
  const auto seen = disjoint_groups(5, 100, 1);
  const CoverRelaxation raised = solve_cover(seen, all_of(500), {300, 1}, 500, kPivots);
  EXPECT_NEAR(raised.lower_bound, 3, 1e-6);
  EXPECT_EQ(raised.rounded.size(), 5u);
}

// A search by swaps proves nothing: one more is allowed, seldom.
TEST(CoverSearch, FindsTheTrueFewestOfSmallSets) {
  int compared = 0, one_more = 0;
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    const auto seen = random_sets(seed, 11, 100, 0.35);
    for (const CoverGoal& goal : {CoverGoal{85, 1}, CoverGoal{70, 2}}) {
      const std::size_t fewest = true_fewest(seen, goal);
      if (fewest > seen.size()) continue;
      const CoverRelaxation relaxation = relax_cover(seen, all_of(100), goal, kSteps);
      const ChosenCover cover = CoverSearch(seen, all_of(100), relaxation, goal.overlap)
                                    .fewest(goal, seen.size(), kSwaps);
      EXPECT_GE(cover.covered, goal.samples);
      EXPECT_GE(cover.chosen.size(), fewest) << seed;
      EXPECT_LE(cover.chosen.size(), fewest + 1) << seed;
      one_more += cover.chosen.size() > fewest;
      std::uint32_t subset = 0;
      for (const std::uint32_t c : cover.chosen) subset |= 1u << c;
      EXPECT_EQ(covered_by(seen, subset, goal.overlap), cover.covered);
      ++compared;
    }
  }
  EXPECT_GT(compared, 30);
  EXPECT_LE(one_more, compared / 10);
}

TEST(CoverSearch, KeepsTheBestWhenTheGoalIsOutOfReach) {
  const auto seen = disjoint_groups(5, 100, 1);
  const CoverRelaxation relaxation = relax_cover(seen, all_of(500), {400, 1}, kSteps);
  const CoverSearch search(seen, all_of(500), relaxation, 1);
  const ChosenCover two = search.fewest({400, 1}, 2, kSwaps);
  EXPECT_EQ(two.chosen.size(), 2u);
  EXPECT_EQ(two.covered, 200u);
  const ChosenCover repaired = search.repaired(two, {400, 1}, 5, kSwaps);
  EXPECT_EQ(repaired.chosen.size(), 4u);
  EXPECT_TRUE(search.with_one_less(repaired, {400, 1}, kSwaps).chosen.empty());
  EXPECT_EQ(search.with_one_less(repaired, {300, 1}, kSwaps).chosen.size(), 3u);
}

TEST(CoverSearch, SamplesOutsideDoNotCount) {
  SampleBits half(500);
  for (std::size_t i = 0; i < 200; ++i) half.set(i);
  const auto seen = disjoint_groups(5, 100, 1);
  const CoverRelaxation relaxation = relax_cover(seen, half, {200, 1}, kSteps);
  EXPECT_LE(relaxation.lower_bound, 2);
  EXPECT_EQ(CoverSearch(seen, half, relaxation, 1).fewest({200, 1}, 5, kSwaps).chosen,
            (std::vector<std::uint32_t>{0, 1}));
}

}  // namespace
}  // namespace organbake
