// SPDX-License-Identifier: Apache-2.0
#include "samples/sample_store.h"

#include <exception>
#include <mutex>
#include <numeric>
#include <vector>

#include "organbake/core/parallel.h"

namespace organbake {

// (Not std::call_once: where what it calls throws, it never returns under ThreadSanitizer, nor
// with some other C libraries.)
struct SampleStore::Slot {
  std::mutex making;
  bool made = false;
  SampleSet set;
};

SampleStore::SampleStore(std::size_t cameras, Make make)
    : count_(cameras), slots_(std::make_unique<Slot[]>(cameras)), make_(std::move(make)) {}
SampleStore::~SampleStore() = default;

void SampleStore::require_one(std::size_t camera) {
  Slot& slot = slots_[camera];
  const std::lock_guard lock(slot.making);
  if (slot.made) return;
  // A thread that waits inside must not pick up another camera, which could wait for this one.
  isolated([&] { slot.set = make_(camera); });
  slot.made = true;
}

void SampleStore::require(std::span<const std::size_t> cameras) {
  parallel_for(std::size_t{0}, cameras.size(), [&](std::size_t i) { require_one(cameras[i]); });
}

void SampleStore::require_all() {
  std::vector<std::size_t> all(count_);
  std::iota(all.begin(), all.end(), std::size_t{0});
  require(all);
}

void SampleStore::make_ahead() {
  ahead_.start([this](const std::atomic<bool>& stop) {
    try {
      for (std::size_t c = 0; c < count_ && !stop; ++c) require_one(c);
    } catch (const std::exception&) {
      // The view that needs this camera says so.
    }
  });
}

bool SampleStore::make_next() {
  if (next_ == count_) return false;
  require_one(next_);
  return ++next_ < count_;
}

const SampleSet& SampleStore::made(std::size_t camera) {
  require_one(camera);
  return slots_[camera].set;
}

const SampleSet& SampleStore::operator[](std::size_t camera) const { return slots_[camera].set; }

}  // namespace organbake
