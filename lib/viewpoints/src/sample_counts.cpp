// SPDX-License-Identifier: GPL-3.0-or-later
// Counts of how often each sample is seen, kept as bit planes: adding a set is a ripple-carry adder
// over words of 64 samples.
#include "sample_counts.h"

#include <algorithm>

namespace organbake {

SampleCounts::SampleCounts(std::size_t samples, int enough, std::size_t most_sets)
    : enough_(static_cast<std::size_t>(enough)),
      planes_(static_cast<std::size_t>(std::bit_width(std::max(most_sets, enough_))),
              SampleBits(samples)),
      lacking_(samples),
      next_(samples),
      last_(samples) {
  mark();
}

// Digit by digit: adding carries where a 1 becomes 0, taking away borrows where a 0 becomes 1.
void SampleCounts::change(const SampleBits& set, bool add) {
  const std::uint64_t turned = add ? 0 : ~std::uint64_t{0};
  for (std::size_t w = 0; w < set.words().size(); ++w) {
    std::uint64_t carry = set.words()[w];
    for (std::size_t b = 0; b < planes_.size() && carry; ++b) {
      std::uint64_t& plane = planes_[b].words()[w];
      const std::uint64_t old = plane;
      plane ^= carry;
      carry &= old ^ turned;
    }
  }
  mark();
}

void SampleCounts::mark() {
  lacking_count_ = 0;
  const std::size_t words = lacking_.words().size();
  for (std::size_t w = 0; w < words; ++w) {
    // From the highest bit down: still like `enough`, like it less one, already below it.
    std::uint64_t like = ~std::uint64_t{0}, like_next = like, below = 0;
    for (std::size_t b = planes_.size(); b-- > 0;) {
      const std::uint64_t plane = planes_[b].words()[w];
      const bool bit = enough_ >> b & 1, bit_next = (enough_ - 1) >> b & 1;
      if (bit) below |= like & ~plane;
      like &= bit ? plane : ~plane;
      like_next &= bit_next ? plane : ~plane;
    }
    const std::size_t in_word =
        std::min(SampleBits::kWordBits, lacking_.size() - w * SampleBits::kWordBits);
    const std::uint64_t present = ~std::uint64_t{0} >> (SampleBits::kWordBits - in_word);
    lacking_.words()[w] = below & present;
    next_.words()[w] = like_next & present;
    last_.words()[w] = like & present;
    lacking_count_ += static_cast<std::size_t>(std::popcount(below & present));
  }
}

}  // namespace organbake
