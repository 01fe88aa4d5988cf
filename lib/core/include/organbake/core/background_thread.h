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

}  // namespace organbake
