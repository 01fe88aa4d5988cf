// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "organbake/viewpoints/sample_bits.h"

namespace organbake {

// How often each sample is seen, 64 of them at once: bit b of a sample's count is its bit in plane
// b, so that a set is added or taken away by the logic of an adder.
class SampleCounts {
 public:
  // Told apart: those below `enough` > 0, those one below it, and those at it. Never more than
  // `most_sets` sets at a time.
  SampleCounts(std::size_t samples, int enough, std::size_t most_sets);

  void add(const SampleBits& set) { change(set, true); }
  void remove(const SampleBits& set) { change(set, false); }  // one that was added

  const SampleBits& lacking() const { return lacking_; }
  const SampleBits& next() const { return next_; }
  const SampleBits& last() const { return last_; }
  std::size_t lacking_count() const { return lacking_count_; }

 private:
  void change(const SampleBits& set, bool add);
  void mark();

  std::size_t enough_;
  std::vector<SampleBits> planes_;
  SampleBits lacking_, next_, last_;
  std::size_t lacking_count_ = 0;
};

}  // namespace organbake
