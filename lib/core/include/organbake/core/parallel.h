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

// body(i) for each of begin … end − 1.
template <class Index, class Body>
void parallel_for(Index begin, Index end, const Body& body) {
  parallel_pieces(begin, end, Index{1}, [&](Index first, Index last) {
    for (Index i = first; i < last; ++i) body(i);
  });
}

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
