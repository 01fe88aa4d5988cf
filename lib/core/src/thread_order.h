// SPDX-License-Identifier: Apache-2.0
#pragma once

// What orders the threads inside TBB is invisible to ThreadSanitizer: Debian's library is not built
// with it. Here it is told of the two moments that TBB promises, so that all between them is
// checked with nothing suppressed. Without ThreadSanitizer none of this leaves a trace in the
// program.
#ifdef ORGANBAKE_THREAD_SANITIZER
extern "C" {
void __tsan_acquire(void* address);
void __tsan_release(void* address);
}
#endif

namespace organbake {

// Whatever happened before one thread's leave() is seen by all threads after their enter(). Each
// object has an address of its own, which is all that it is known by.
class ThreadOrder {
 public:
#ifdef ORGANBAKE_THREAD_SANITIZER
  void leave() { __tsan_release(this); }
  void enter() { __tsan_acquire(this); }
#else
  void leave() {}
  void enter() {}
#endif
};

// The order of work that is shared out: what is before the sharing happens before each piece, and
// each piece before what follows the wait, also where a piece throws.
class SharedWork {
 public:
  SharedWork() { begun_.leave(); }

  class Piece {
   public:
    explicit Piece(SharedWork& work) : work_(work) { work_.begun_.enter(); }
    ~Piece() { work_.done_.leave(); }
    Piece(const Piece&) = delete;
    Piece& operator=(const Piece&) = delete;

   private:
    SharedWork& work_;
  };
  class Wait {
   public:
    explicit Wait(SharedWork& work) : work_(work) {}
    ~Wait() { work_.done_.enter(); }
    Wait(const Wait&) = delete;
    Wait& operator=(const Wait&) = delete;

   private:
    SharedWork& work_;
  };

  void share_again() { begun_.leave(); }

 private:
  ThreadOrder begun_, done_;
};

}  // namespace organbake
