// SPDX-License-Identifier: Apache-2.0
#include "core/background_tasks.h"

#include <utility>

#ifndef ORGANBAKE_NO_THREADS
#include <tbb/task_arena.h>
#include <tbb/task_group.h>
#endif

namespace organbake {

#ifndef ORGANBAKE_NO_THREADS

struct BackgroundTasks::Impl {
  tbb::task_group group;
};

BackgroundTasks::BackgroundTasks() : impl_(new Impl) {}

BackgroundTasks::~BackgroundTasks() {
  impl_->group.cancel();
  try {
    impl_->group.wait();
  } catch (...) {  // something else ended the work already
  }
}

void BackgroundTasks::run(std::function<void()> task) { impl_->group.run(std::move(task)); }
void BackgroundTasks::wait() { impl_->group.wait(); }
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
