// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <new>
#include <utility>

namespace organbake {

// `bytes` of memory that hold zeros. Pages that are not written take no room. Throws
// std::bad_alloc.
void* allocate_zeroed(std::size_t bytes);
void free_zeroed(void* memory, std::size_t bytes) noexcept;

// An allocator for the voxels of a volume. The system hands out zeros, so new values are not
// written once more: the background of a mask, most of its voxels, takes neither time nor room. A
// vector that shrank and grows again finds its old values there.
template <class Value>
struct ZeroedPages {
  using value_type = Value;

  ZeroedPages() = default;
  template <class Other>
  ZeroedPages(const ZeroedPages<Other>&) noexcept {}  // implicit, as allocators have to be

  Value* allocate(std::size_t count) {
    if (count > static_cast<std::size_t>(-1) / sizeof(Value)) throw std::bad_array_new_length();
    return static_cast<Value*>(allocate_zeroed(count * sizeof(Value)));
  }
  void deallocate(Value* values, std::size_t count) noexcept {
    free_zeroed(values, count * sizeof(Value));
  }
  void construct(Value*) const noexcept {}  // 0 already
  template <class From>
  void construct(Value* at, From&& from) const {
    ::new (static_cast<void*>(at)) Value(std::forward<From>(from));
  }
  friend bool operator==(const ZeroedPages&, const ZeroedPages&) { return true; }
};

}  // namespace organbake
