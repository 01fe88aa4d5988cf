// SPDX-License-Identifier: Apache-2.0
#include "organbake/core/parallel.h"

#include "thread_order.h"

#ifndef ORGANBAKE_NO_THREADS
#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#endif

namespace organbake::parallel_detail {

#ifndef ORGANBAKE_NO_THREADS

void share_out(std::size_t count, std::size_t grain, Work work, const void* body) {
  using Range = tbb::blocked_range<std::size_t>;
  SharedWork shared;
  const SharedWork::Wait wait(shared);
  tbb::parallel_for(Range(0, count, grain), [&](const Range& range) {
    const SharedWork::Piece piece(shared);
    work(body, range.begin(), range.end());
  });
}

void isolate(Work work, const void* body) {
  tbb::this_task_arena::isolate([&] { work(body, 0, 0); });
}

#else

void share_out(std::size_t count, std::size_t, Work work, const void* body) {
  work(body, 0, count);
}

void isolate(Work work, const void* body) { work(body, 0, 0); }

#endif

}  // namespace organbake::parallel_detail

namespace organbake {

#ifndef ORGANBAKE_NO_THREADS
struct ThreadLimit::Impl {
  tbb::global_control control;
};
ThreadLimit::ThreadLimit(int threads)
    : impl_(new Impl{
          {tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads)}}) {}
#else
struct ThreadLimit::Impl {};
ThreadLimit::ThreadLimit(int) {}
#endif
ThreadLimit::~ThreadLimit() = default;

}  // namespace organbake
