// SPDX-License-Identifier: Apache-2.0
// Settings of glibc's malloc for a program that takes and frees hundreds of megabytes: freed memory
// is kept, and the heap is reserved at once, so that the system can give it pages of 2 MB.
#include "organbake/core/heap.h"

#include <cstdint>
#include <cstdlib>

#ifdef __GLIBC__
#include <malloc.h>
#include <sys/mman.h>
#include <unistd.h>
#endif

namespace organbake {

void keep_heap_in_large_pages() {
#ifdef __GLIBC__
  constexpr std::uintptr_t kPage = std::uintptr_t{2} << 20;
  constexpr int kReserved = 512 << 20;  // of addresses; pages come when they are written
  constexpr int kLargest = 32 << 20;    // what is larger glibc maps on its own, whatever is asked
  constexpr int kLater = 16 << 20;      // the steps in which the heap grows beyond
  mallopt(M_ARENA_MAX, 1);              // or no thread would take what another freed
  mallopt(M_MMAP_THRESHOLD, kLargest);
  mallopt(M_TRIM_THRESHOLD, 2 * kReserved);
  mallopt(M_TOP_PAD, kReserved);
  const auto heap_end = [] { return reinterpret_cast<std::uintptr_t>(sbrk(0)); };
  const std::uintptr_t begin = (heap_end() + kPage - 1) / kPage * kPage;
  // (volatile: or the compiler leaves the pair out.) No more than makes the heap grow: a large page
  // of which something was written before madvise() stays small ones.
  constexpr std::size_t kMoreThanThereIs = 160 << 10;
  void* volatile grown = std::malloc(kMoreThanThereIs);
  const auto first = reinterpret_cast<std::uintptr_t>(grown);
  std::free(grown);
  const std::uintptr_t end = heap_end() / kPage * kPage;
  mallopt(M_TOP_PAD, kLater);
  if (end <= begin || first == 0 || first >= begin) return;
  madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);
  // What lies before the first large page is left alone.
  [[maybe_unused]] static void* volatile before;
  before = std::malloc(begin - first);
#endif
}

}  // namespace organbake
