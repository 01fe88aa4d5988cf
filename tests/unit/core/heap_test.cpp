// SPDX-License-Identifier: Apache-2.0
#include "organbake/core/heap.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <vector>

namespace organbake {
namespace {

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

TEST(Heap, MayBeAskedTwice) {
  keep_heap_in_large_pages();
  keep_heap_in_large_pages();
  EXPECT_EQ(std::vector<int>(1 << 24, 7).back(), 7);
}

}  // namespace
}  // namespace organbake
