// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <memory>

namespace organbake {

// At most one thread that works on its own, asked to stop and waited for when its owner goes.
class BackgroundThread {
 public:
  using Work = std::function<void(const std::atomic<bool>& stop)>;

  BackgroundThread();
  ~BackgroundThread();
  BackgroundThread(BackgroundThread&&) noexcept;

  // Whether a thread begins the work: not a second time, and never in a build without threads.
  bool start(Work work);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Work that goes on beside the caller's, on the threads that it may take; where a build has none
// it is done at once. Left early, what has not begun is dropped.
class BackgroundTasks {
 public:
  BackgroundTasks();
  ~BackgroundTasks();
  BackgroundTasks(const BackgroundTasks&) = delete;
  BackgroundTasks& operator=(const BackgroundTasks&) = delete;

  void run(std::function<void()> task);
  void wait();                    // throws what a task threw
  static int most_at_the_time();  // ≥ 1

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace organbake
