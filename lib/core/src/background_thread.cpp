// SPDX-License-Identifier: Apache-2.0
// A thread of its own for long work; its owner's end asks it to stop and waits for it. A build
// without threads starts none, and the caller does the work itself.
#include "organbake/core/background.h"

#include <thread>
#include <utility>

namespace organbake {

#ifndef ORGANBAKE_NO_THREADS

struct BackgroundThread::Impl {
  std::atomic<bool> stop = false;
  Work work;
  std::thread thread;

  ~Impl() {
    stop = true;
    if (thread.joinable()) thread.join();
  }
};

bool BackgroundThread::start(Work work) {
  if (impl_) return false;
  impl_ = std::make_unique<Impl>();
  impl_->work = std::move(work);
  impl_->thread = std::thread([own = impl_.get()] { own->work(own->stop); });
  return true;
}

#else

struct BackgroundThread::Impl {};
bool BackgroundThread::start(Work) { return false; }

#endif

BackgroundThread::BackgroundThread() = default;
BackgroundThread::~BackgroundThread() = default;
BackgroundThread::BackgroundThread(BackgroundThread&&) noexcept = default;

}  // namespace organbake
