// SPDX-License-Identifier: Apache-2.0
// Tasks beside the caller's own work: a group of TBB's or, in a build without threads, plain calls.
#include "organbake/core/background.h"

#include <utility>

#include "thread_order.h"

#ifndef ORGANBAKE_NO_THREADS
#include <tbb/task_arena.h>
#include <tbb/task_group.h>
#endif

namespace organbake {

#ifndef ORGANBAKE_NO_THREADS

struct BackgroundTasks::Impl {
  tbb::task_group group;
  SharedWork shared;

  void wait() {
    const SharedWork::Wait until_done(shared);
    group.wait();
  }
};

BackgroundTasks::BackgroundTasks() : impl_(new Impl) {}

BackgroundTasks::~BackgroundTasks() {
  impl_->group.cancel();
  try {
    impl_->wait();
  } catch (...) {  // something else ended the work already
  }
}

void BackgroundTasks::run(std::function<void()> task) {
  impl_->shared.share_again();
  impl_->group.run([task = std::move(task), &shared = impl_->shared] {
    const SharedWork::Piece piece(shared);
    task();
  });
}
void BackgroundTasks::wait() { impl_->wait(); }
int BackgroundTasks::most_at_the_time() { return tbb::this_task_arena::max_concurrency(); }

#else

struct BackgroundTasks::Impl {};

BackgroundTasks::BackgroundTasks() = default;
BackgroundTasks::~BackgroundTasks() = default;
void BackgroundTasks::run(std::function<void()> task) { task(); }
void BackgroundTasks::wait() {}
int BackgroundTasks::most_at_the_time() { return 1; }

#endif

}  // namespace organbake
