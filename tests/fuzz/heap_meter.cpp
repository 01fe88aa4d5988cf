// SPDX-License-Identifier: GPL-3.0-or-later
#include "fuzz/heap_meter.h"

#include <malloc.h>

#include <atomic>
#include <cerrno>

namespace {

std::atomic<std::size_t> given{0}, most_given{0};

// Only for what is used at all: memory that nobody touched costs nothing until it is, but a reader
// that asks for it is about to.
void* counted(void* block) {
  if (!block) return block;
  const std::size_t size = malloc_usable_size(block);
  const std::size_t now = given.fetch_add(size, std::memory_order_relaxed) + size;
  std::size_t most = most_given.load(std::memory_order_relaxed);
  while (now > most && !most_given.compare_exchange_weak(most, now, std::memory_order_relaxed)) {
  }
  return block;
}

void uncount(void* block) {
  if (block) given.fetch_sub(malloc_usable_size(block), std::memory_order_relaxed);
}

}  // namespace

#if !defined(__SANITIZE_ADDRESS__)

// glibc lets a program put its own functions in these places ("Replacing malloc" in its manual),
// and keeps its own reachable under these names.
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);

void* malloc(std::size_t size) { return counted(__libc_malloc(size)); }
void* calloc(std::size_t count, std::size_t size) { return counted(__libc_calloc(count, size)); }
void* realloc(void* block, std::size_t size) {
  uncount(block);
  void* const moved = __libc_realloc(block, size);
  if (!moved && size > 0) return counted(block), moved;  // the old block stays
  return counted(moved);
}
void* memalign(std::size_t alignment, std::size_t size) {
  return counted(__libc_memalign(alignment, size));
}
void* aligned_alloc(std::size_t alignment, std::size_t size) { return memalign(alignment, size); }
int posix_memalign(void** block, std::size_t alignment, std::size_t size) {
  *block = memalign(alignment, size);
  return *block ? 0 : ENOMEM;
}
void free(void* block) {
  uncount(block);
  __libc_free(block);
}
}

#endif

namespace organbake {

HeapMeter::HeapMeter() : at_start_(given) { most_given = at_start_; }

std::size_t HeapMeter::most_bytes() const {
  const std::size_t most = most_given;
  return most > at_start_ ? most - at_start_ : 0;
}

}  // namespace organbake
