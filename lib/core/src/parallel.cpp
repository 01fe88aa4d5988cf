// SPDX-License-Identifier: Apache-2.0
// Parallel loops by TBB; with ORGANBAKE_THREADS off each of them runs in order. A loop reports the
// processor time of its pieces to the work meter that its caller has set up, which tells how far
// more threads could help (Brent 1974).
#include "organbake/core/parallel.h"

#include "organbake/core/one_thread.h"
#include "thread_order.h"

#ifndef ORGANBAKE_NO_THREADS
#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <tbb/task_group.h>
#endif

#include <algorithm>
#include <atomic>

namespace organbake {
namespace {

#ifndef ORGANBAKE_NO_THREADS
thread_local
#endif
    WorkMeter* metering = nullptr;
#ifndef ORGANBAKE_NO_THREADS
thread_local
#endif
    bool working_alone = false;

// The processor time that this thread has taken, or without threads the time of a steady clock.
double processor_ms() {
  timespec now{};
#ifndef ORGANBAKE_NO_THREADS
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
#else
  clock_gettime(CLOCK_MONOTONIC, &now);
#endif
  return 1e3 * double(now.tv_sec) + 1e-6 * double(now.tv_nsec);
}

}  // namespace

OneThread::OneThread() : before_(std::exchange(working_alone, true)) {}
OneThread::~OneThread() { working_alone = before_; }

WorkMeter::WorkMeter() : outer_(std::exchange(metering, this)), start_ms_(processor_ms()) {}
WorkMeter::~WorkMeter() { metering = outer_; }

WorkSpan WorkMeter::lap() {
  const double now_ms = processor_ms();
  const double alone_ms = now_ms - start_ms_ - std::exchange(loops_ms_, 0);
  const WorkSpan loops = std::exchange(loops_, {});
  start_ms_ = now_ms;
  return {alone_ms + loops.work_ms, alone_ms + loops.span_ms};
}

// A parallel loop's pieces, on their way into the meter of whoever shared it out; without a meter
// they are just done.
class MeteredPieces {
 public:
  MeteredPieces() : meter_(metering) {
    if (meter_) start_ms_ = processor_ms();
  }
  ~MeteredPieces() {
    if (!meter_) return;
    meter_->loops_.work_ms += sum_.work_ms;
    meter_->loops_.span_ms += sum_.span_ms;
    meter_->loops_ms_ += processor_ms() - start_ms_;
  }
  MeteredPieces(const MeteredPieces&) = delete;
  MeteredPieces& operator=(const MeteredPieces&) = delete;

  bool metered() const { return meter_ != nullptr; }

  void run(parallel_detail::Work work, const void* body, std::size_t first, std::size_t last) {
    if (!meter_) return work(body, first, last);
    WorkMeter own;
    work(body, first, last);
    const WorkSpan piece = own.lap();
    const std::lock_guard lock(mutex_);
    sum_.work_ms += piece.work_ms;
    sum_.span_ms = std::max(sum_.span_ms, piece.span_ms);
  }

 private:
  WorkMeter* const meter_;
  double start_ms_ = 0;
  std::mutex mutex_;
  WorkSpan sum_;
};

}  // namespace organbake

namespace organbake::parallel_detail {

#ifndef ORGANBAKE_NO_THREADS

namespace {

template <class Partitioner>
void run_pieces(std::size_t count, std::size_t grain, const auto& run, const Partitioner& how) {
  using Range = tbb::blocked_range<std::size_t>;
  SharedWork shared;
  const SharedWork::Wait wait(shared);
  const auto run_piece = [&](const Range& range) {
    const SharedWork::Piece piece(shared);
    run(range.begin(), range.end());
  };
  // A context of its own: an exception in another thread's piece of a loop around this one must not
  // cancel it, since whoever shared it out goes on with what it was to write.
  tbb::task_group_context apart(tbb::task_group_context::isolated);
  tbb::parallel_for(Range(0, count, grain), run_piece, how, apart);
}

}  // namespace

void share_out(std::size_t count, std::size_t grain, Work work, const void* body) {
  MeteredPieces pieces;
  if (working_alone) return pieces.run(work, body, 0, count);
  const auto run = [&](std::size_t first, std::size_t last) {
    pieces.run(work, body, first, last);
  };
  if (pieces.metered()) return run_pieces(count, grain, run, tbb::simple_partitioner());
  run_pieces(count, grain, run, tbb::auto_partitioner());
}

void share_out_in_order(std::size_t count, Work work, const void* body) {
  MeteredPieces pieces;
  std::atomic<std::size_t> next = 0;
  const auto take = [&](std::size_t, std::size_t) {
    for (std::size_t i = next++; i < count; i = next++) pieces.run(work, body, i, i + 1);
  };
  const auto takers = std::min(count, static_cast<std::size_t>(allowed_threads()));
  if (working_alone) return take(0, takers);
  run_pieces(takers, 1, take, tbb::simple_partitioner());
}

void isolate(Work work, const void* body) {
  tbb::this_task_arena::isolate([&] { work(body, 0, 0); });
}

#else

void share_out(std::size_t count, std::size_t, Work work, const void* body) {
  MeteredPieces().run(work, body, 0, count);
}

void share_out_in_order(std::size_t count, Work work, const void* body) {
  MeteredPieces pieces;
  for (std::size_t i = 0; i < count; ++i) pieces.run(work, body, i, i + 1);
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
int allowed_threads() {
  if (working_alone) return 1;
  return static_cast<int>(
      tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
}
#else
struct ThreadLimit::Impl {};
ThreadLimit::ThreadLimit(int) {}
int allowed_threads() { return 1; }
#endif
ThreadLimit::~ThreadLimit() = default;

}  // namespace organbake
