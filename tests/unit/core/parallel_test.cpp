// SPDX-License-Identifier: Apache-2.0

#include <sys/resource.h>
#include <atomic>

#include "organbake/core/background.h"
#include "organbake/core/heap.h"
#include "organbake/core/parallel.h"
#include "organbake/core/quantile.h"
#include "organbake/core/random.h"
#include "organbake/core/smooth_step.h"
#include "support/testing.h"

namespace organbake {
namespace {

TEST(Parallel, CallsEachIndexOnce) {
  std::vector<std::atomic<int>> calls(10'007);
  parallel_for(7, 10'007, [&](int i) { ++calls[i]; });
  for (int i = 0; i < 10'007; ++i) ASSERT_EQ(calls[i], i < 7 ? 0 : 1) << i;
}

TEST(Parallel, PiecesCoverARangeOfNegativeNumbers) {
  std::atomic<int> sum = 0, count = 0;
  parallel_pieces(-50, 51, 10, [&](int first, int last) {
    ASSERT_LT(first, last);
    for (int i = first; i < last; ++i) sum += i, ++count;
  });
  EXPECT_EQ(sum, 0);
  EXPECT_EQ(count, 101);
}

TEST(Parallel, DoesNothingForAnEmptyRange) {
  parallel_for(3, 3, [](int) { FAIL(); });
  parallel_for(4, 3, [](int) { FAIL(); });
}

TEST(Parallel, ThrowsWhatABodyThrows) {
  const auto throwing = [](int i) {
    if (i == 500) throw std::runtime_error("here");
  };
  EXPECT_THROW(parallel_for(0, 1000, throwing), std::runtime_error);
}

TEST(Parallel, InOrderBeginsWithTheFirst) {
  const ThreadLimit one(1);
  std::vector<std::size_t> begun;
  parallel_in_order(100, [&](std::size_t i) { begun.push_back(i); });
  std::vector<std::size_t> expected(100);
  std::iota(expected.begin(), expected.end(), 0u);
  EXPECT_EQ(begun, expected);
}

TEST(Parallel, InOrderCallsEachIndexOnceAndThrowsWhatABodyThrows) {
  std::vector<std::atomic<int>> calls(1000);
  parallel_in_order(calls.size(), [&](std::size_t i) { ++calls[i]; });
  for (const auto& count : calls) ASSERT_EQ(count, 1);
  parallel_in_order(0, [](std::size_t) { FAIL(); });
  const auto throwing = [](std::size_t i) {
    if (i == 50) throw std::runtime_error("here");
  };
  EXPECT_THROW(parallel_in_order(100, throwing), std::runtime_error);
}

// Another piece's exception ends the loop around it, never the loop within it half-way: whoever
// shared that one out goes on with all that it was to write.
TEST(Parallel, ALoopWithinALoopIsDoneWholeWhateverItsNeighboursThrow) {
  for (int again = 0; again < 50; ++again) {
    std::atomic<int> left_out = 0;
    const auto piece = [&](std::size_t i) {
      if (i == 1) throw std::runtime_error("of a neighbour");
      for (int loop = 0; loop < 200; ++loop) {
        std::vector<int> written(64, 0);
        parallel_for(std::size_t{0}, written.size(), [&](std::size_t k) { written[k] = 1; });
        left_out += int(std::count(written.begin(), written.end(), 0));
      }
    };
    EXPECT_THROW(parallel_in_order(4, piece), std::runtime_error);
    EXPECT_EQ(left_out, 0);
  }
}

TEST(Parallel, AsManyThreadsAsAreAllowed) {
  const ThreadLimit two(2);
  if (allowed_threads() == 1) GTEST_SKIP() << "a build without threads";
  EXPECT_EQ(allowed_threads(), 2);
}

// Takes so much processor time, at least: no test asks how much more.
void work_for(double ms) {
  WorkMeter meter;
  while (ms > 0) ms -= meter.lap().work_ms;
}

TEST(WorkMeter, ALoopIsTheSumOfItsPiecesAndTheLongestOfThem) {
  WorkMeter meter;
  parallel_for(0, 8, [](int i) { work_for(i == 3 ? 40 : 5); });
  const WorkSpan loop = meter.lap();
  EXPECT_GE(loop.work_ms, 75);
  EXPECT_GE(loop.span_ms, 40);
  EXPECT_LT(loop.span_ms, loop.work_ms);
}

TEST(WorkMeter, WhatIsDoneAloneCountsAsBoth) {
  WorkMeter meter;
  work_for(5);
  const WorkSpan alone = meter.lap();
  EXPECT_GE(alone.work_ms, 5);
  EXPECT_EQ(alone.work_ms, alone.span_ms);
  parallel_in_order(4, [](std::size_t) { work_for(5); });
  const WorkSpan loop = meter.lap();
  EXPECT_GE(loop.work_ms, 20);
  EXPECT_LT(loop.span_ms, loop.work_ms);
}

TEST(WorkMeter, SeesLoopsWithinLoops) {
  WorkMeter meter;
  parallel_for(0, 1, [](int) { parallel_for(0, 4, [](int) { work_for(5); }); });
  const WorkSpan loops = meter.lap();
  EXPECT_GE(loops.work_ms, 20);
  EXPECT_GE(loops.span_ms, 5);
  EXPECT_LT(loops.span_ms, loops.work_ms);
}

TEST(PerThread, EachThreadKeepsItsOwn) {
  PerThread<std::vector<int>> lists;
  parallel_for(0, 1000, [&](int i) { lists.local().push_back(i); });
  parallel_for(0, 1000, [&](int i) { lists.local().push_back(i); });
  std::size_t count = 0;
  long sum = 0;
  lists.each([&](const std::vector<int>& list) {
    count += list.size();
    sum += std::accumulate(list.begin(), list.end(), 0L);
  });
  EXPECT_EQ(count, 2000u);
  EXPECT_EQ(sum, 999'000);
}

TEST(BackgroundThread, IsAskedToStopAndWaitedFor) {
  std::atomic<bool> began = false, ended = false;
  {
    BackgroundThread thread;
    const bool starts = thread.start([&](const std::atomic<bool>& stop) {
      began = true;
      while (!stop) std::this_thread::yield();
      ended = true;
    });
    if (!starts) GTEST_SKIP() << "a build without threads";
    EXPECT_FALSE(thread.start([](const std::atomic<bool>&) { FAIL(); }));
    while (!began) std::this_thread::yield();
    EXPECT_FALSE(ended);
  }
  EXPECT_TRUE(ended);
}

#ifdef __SANITIZE_THREAD__
// Else what ThreadSanitizer is told of TBB (core/thread_order.h) could have made it blind.
TEST(ThreadSanitizerDeathTest, SeesARaceInSharedWork) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto race = [] {
    long sum = 0;
    parallel_for(0, 1'000'000, [&](int i) { sum += i; });
    std::exit(sum == 0 ? 1 : 0);  // its own exit code takes the place of this
  };
  EXPECT_EXIT(race(), testing::ExitedWithCode(66), "data race");
}
#endif

TEST(RandomStream, BelongsToItsItem) {
  RandomStream a(7, 3), again(7, 3), other_item(7, 4), other_seed(8, 3);
  const auto first = a();
  EXPECT_EQ(first, again());
  EXPECT_NE(first, other_item());
  EXPECT_NE(first, other_seed());
}

TEST(RandomStream, IsFrozen) {
  // Phantoms and their baked bytes hang on these numbers.
  RandomStream stream(1, 2);
  const auto first = stream(), second = stream();
  RandomStream replay(1, 2);
  EXPECT_EQ(replay(), first);
  EXPECT_EQ(replay(), second);
  EXPECT_NE(first, second);
}

TEST(RandomStream, BelowReachesEveryValueEvenly) {
  std::array<int, 7> counts{};
  RandomStream stream(5);
  for (int i = 0; i < 70000; ++i) ++counts[stream.below(7)];
  for (const int count : counts) EXPECT_NEAR(count, 10000, 500);  // five standard deviations
}

TEST(Quantile, IsWhatSortingSays) {
  RandomStream random(5);
  std::vector<double> values;
  for (int k = 0; k < 101; ++k) values.push_back(random.uniform());
  std::vector<double> sorted = values;
  std::sort(sorted.begin(), sorted.end());
  EXPECT_EQ(quantile(values, 0), sorted.front());
  EXPECT_EQ(quantile(values, 0.25), sorted[25]);
  EXPECT_EQ(quantile(values, 0.259), sorted[25]) << "the lower of two";
  EXPECT_EQ(quantile(values, 1), sorted.back());
  EXPECT_EQ(median(values), sorted[50]);
  EXPECT_EQ(quantile(std::vector<double>{}, 0.5), 0);
}

TEST(SmoothStep, RisesOrFallsBetweenItsEnds) {
  EXPECT_EQ(smooth_step(2, 4, 1), 0);
  EXPECT_EQ(smooth_step(2, 4, 3), 0.5);
  EXPECT_EQ(smooth_step(2, 4, 9), 1);
  EXPECT_EQ(smooth_step(4, 2, 2.5), 1 - smooth_step(2, 4, 2.5));
}

// Of the pages that are written, how many the system had to bring.
long faults_of_writing(std::size_t bytes) {
  rusage before{}, after{};
  getrusage(RUSAGE_SELF, &before);
  std::vector<char> written(bytes, 1);
  getrusage(RUSAGE_SELF, &after);
  EXPECT_EQ(written.back(), 1);
  return after.ru_minflt - before.ru_minflt;
}

TEST(Heap, KeepsWhatWasFreed) {
#if !defined(__GLIBC__) || defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "another malloc than glibc's";
#endif
  constexpr std::size_t kBytes = std::size_t{24} << 20, kPages = kBytes / 4096;
  keep_heap_in_large_pages();
  faults_of_writing(kBytes);
  EXPECT_LT(faults_of_writing(kBytes), long(kPages / 10));
}

}  // namespace
}  // namespace organbake
