// SPDX-License-Identifier: GPL-3.0-or-later
#include "sample_counts.h"

#include <gtest/gtest.h>

#include "organbake/core/random.h"

namespace organbake {
namespace {

// Against counting one by one, over sizes round whole words and thresholds round powers of two.
TEST(SampleCounts, CountsLikeANaiveCounter) {
  for (const std::size_t samples : {1, 63, 64, 65, 200}) {
    for (const int enough : {1, 2, 3, 4, 5}) {
      constexpr std::size_t kMost = 9;
      RandomStream random(samples, std::uint64_t(enough));
      SampleCounts counts(samples, enough, kMost);
      std::vector<int> times(samples, 0);
      std::vector<SampleBits> sets;
      for (int step = 0; step < 60; ++step) {
        const bool adds = sets.empty() || (sets.size() < kMost && random.below(3) > 0);
        if (adds) {
          SampleBits set(samples);
          for (std::size_t i = 0; i < samples; ++i)
            if (random.below(2)) set.set(i);
          counts.add(set);
          for (std::size_t i = 0; i < samples; ++i) times[i] += set.test(i);
          sets.push_back(set);
        } else {
          const std::size_t which = random.below(sets.size());
          counts.remove(sets[which]);
          for (std::size_t i = 0; i < samples; ++i) times[i] -= sets[which].test(i);
          sets.erase(sets.begin() + std::ptrdiff_t(which));
        }
        std::size_t lacking = 0;
        for (std::size_t i = 0; i < samples; ++i) {
          ASSERT_EQ(counts.lacking().test(i), times[i] < enough) << samples << " " << enough;
          ASSERT_EQ(counts.next().test(i), times[i] == enough - 1);
          ASSERT_EQ(counts.last().test(i), times[i] == enough);
          lacking += times[i] < enough;
        }
        ASSERT_EQ(counts.lacking_count(), lacking);
        ASSERT_EQ(counts.lacking().count(), lacking) << "no bits beyond the samples";
      }
    }
  }
}

}  // namespace
}  // namespace organbake
