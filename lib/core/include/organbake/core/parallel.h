// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

// The runtime's threads, in one place: TBB's, within whatever arena or limit the caller set; or
// none, where a build has no threads (a web page): then everything runs in order, with the same
// results. Where each index is written by one call alone, the order never shows.
namespace organbake {

namespace parallel_detail {
using Work = void (*)(const void* body, std::size_t begin, std::size_t end);
void share_out(std::size_t count, std::size_t grain, Work work, const void* body);
void share_out_in_order(std::size_t count, Work work, const void* body);
void isolate(Work work, const void* body);
}  // namespace parallel_detail

// body(first, last) for pieces that cover begin … end − 1, of at least half of `grain` where there
// is as much. Throws what a body throws.
template <class Index, class Body>
void parallel_pieces(Index begin, Index end, Index grain, const Body& body) {
  if (!(begin < end)) return;
  const auto shifted = [&](std::size_t first, std::size_t last) {
    body(static_cast<Index>(begin + static_cast<Index>(first)),
         static_cast<Index>(begin + static_cast<Index>(last)));
  };
  parallel_detail::share_out(
      static_cast<std::size_t>(end - begin), static_cast<std::size_t>(grain),
      [](const void* bound, std::size_t first, std::size_t last) {
        (*static_cast<const decltype(shifted)*>(bound))(first, last);
      },
      &shifted);
}

// body(i) for each of begin … end − 1, of which pieces of `grain` are worked on at once.
template <class Index, class Body>
void parallel_each(Index begin, Index end, Index grain, const Body& body) {
  parallel_pieces(begin, end, grain, [&](Index i, Index last) {
    for (; i < last; ++i) body(i);
  });
}

// Each at once with all others.
template <class Index, class Body>
void parallel_for(Index begin, Index end, const Body& body) {
  parallel_each(begin, end, Index{1}, body);
}

// body(i) for each of 0 … count − 1, begun in this order by whichever thread is free next: with the
// dearest first, none is left to the end that all others wait for.
template <class Body>
void parallel_in_order(std::size_t count, const Body& body) {
  parallel_detail::share_out_in_order(
      count,
      [](const void* bound, std::size_t i, std::size_t) { (*static_cast<const Body*>(bound))(i); },
      &body);
}

// Both, at once or one after the other.
template <class One, class Other>
void parallel_both(const One& one, const Other& other) {
  parallel_for(0, 2, [&](int i) { i == 0 ? one() : other(); });
}

// How many threads may work at once, the caller's included.
int allowed_threads();

// Runs `body` so that the thread, while it waits inside for others, takes up none of the work
// outside.
template <class Body>
void isolated(const Body& body) {
  parallel_detail::isolate(
      [](const void* bound, std::size_t, std::size_t) { (*static_cast<const Body*>(bound))(); },
      &body);
}

// As long as it lives no more threads than that work, the caller's included.
class ThreadLimit {
 public:
  explicit ThreadLimit(int threads);  // ≥ 1
  ~ThreadLimit();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// What work costs: all of it one after the other, T₁, and its longest chain of parts that wait for
// each other, T∞. N threads need at least max(T₁ / N, T∞), and with T₁ / N + T∞ they can do (Brent
// 1974, "The Parallel Evaluation of General Arithmetic Expressions").
struct WorkSpan {
  double work_ms = 0, span_ms = 0;
};

// Counts both for what its thread does while it lives, whatever number of threads take part: a
// parallel loop counts as the sum of its pieces, and as the longest of them. Its loops are then cut
// into all the pieces that they can be. In processor time, so that a busy machine tells the same as
// a quiet one. Meters nest; the innermost one counts.
class WorkMeter {
 public:
  WorkMeter();
  ~WorkMeter();
  WorkMeter(const WorkMeter&) = delete;
  WorkMeter& operator=(const WorkMeter&) = delete;

  // Since it was made, or since the last lap.
  WorkSpan lap();

 private:
  friend class MeteredPieces;

  WorkMeter* outer_;
  double start_ms_;
  WorkSpan loops_;       // of the parallel loops since then
  double loops_ms_ = 0;  // that this thread took part in them
};

// One value for each thread that asks for its own, kept from one use to the next.
template <class Value>
class PerThread {
 public:
  Value& local() {
    const std::lock_guard lock(mutex_);
    for (auto& [thread, value] : values_) {
      if (thread == std::this_thread::get_id()) return *value;
    }
    return *values_.emplace_back(std::this_thread::get_id(), std::make_unique<Value>()).second;
  }
  // visit(value) of all threads that asked; none may work meanwhile.
  template <class Visit>
  void each(const Visit& visit) {
    for (auto& entry : values_) visit(*entry.second);
  }
  template <class Visit>
  void each(const Visit& visit) const {
    for (const auto& entry : values_) visit(std::as_const(*entry.second));
  }

 private:
  std::mutex mutex_;
  std::vector<std::pair<std::thread::id, std::unique_ptr<Value>>> values_;
};

}  // namespace organbake
