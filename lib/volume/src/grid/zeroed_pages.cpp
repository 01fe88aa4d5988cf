// SPDX-License-Identifier: GPL-3.0-or-later
// Large pieces are mapped, in huge pages where the system has them: a volume of half a gigabyte
// would be asked for in 130,000 small ones.
#include "organbake/volume/zeroed_pages.h"

#include <sys/mman.h>

#include <cstdlib>

namespace organbake {
namespace {

constexpr std::size_t kMapped = std::size_t{1} << 22;

}  // namespace

void* allocate_zeroed(std::size_t bytes) {
  if (bytes < kMapped) {
    void* const memory = std::calloc(bytes > 0 ? bytes : 1, 1);
    if (!memory) throw std::bad_alloc();
    return memory;
  }
  void* const memory =
      ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) throw std::bad_alloc();
  ::madvise(memory, bytes, MADV_HUGEPAGE);  // a hint
  return memory;
}

void free_zeroed(void* memory, std::size_t bytes) noexcept {
  if (bytes < kMapped) {
    std::free(memory);
  } else {
    ::munmap(memory, bytes);
  }
}

}  // namespace organbake
