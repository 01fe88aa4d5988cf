// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace organbake {

// Which of a number of surface samples, a bit each: counting what two sets share is most of the
// work of choosing cameras.
class SampleBits {
 public:
  static constexpr std::size_t kWordBits = 64;

  explicit SampleBits(std::size_t size = 0)
      : size_(size), words_((size + kWordBits - 1) / kWordBits) {}

  std::size_t size() const { return size_; }
  void set(std::size_t i) { words_[i / kWordBits] |= std::uint64_t{1} << (i % kWordBits); }
  bool test(std::size_t i) const { return words_[i / kWordBits] >> (i % kWordBits) & 1; }
  std::span<std::uint64_t> words() { return words_; }
  std::span<const std::uint64_t> words() const { return words_; }

  std::size_t count() const {
    std::size_t sum = 0;
    for (const std::uint64_t word : words_) sum += std::popcount(word);
    return sum;
  }
  // Calls take(i) for each that is set, in order.
  template <class Take>
  void for_each(const Take& take) const {
    for (std::size_t w = 0; w < words_.size(); ++w) {
      for (std::uint64_t bits = words_[w]; bits; bits &= bits - 1)
        take(w * kWordBits + static_cast<std::size_t>(std::countr_zero(bits)));
    }
  }
  void append(const SampleBits& other) {
    const std::size_t first = size_;
    size_ += other.size_;
    words_.resize((size_ + kWordBits - 1) / kWordBits);
    other.for_each([&](std::size_t i) { set(first + i); });
  }
  SampleBits& operator|=(const SampleBits& other) {
    for (std::size_t w = 0; w < words_.size(); ++w) words_[w] |= other.words_[w];
    return *this;
  }
  SampleBits& operator&=(const SampleBits& other) {
    for (std::size_t w = 0; w < words_.size(); ++w) words_[w] &= other.words_[w];
    return *this;
  }

 private:
  std::size_t size_;
  std::vector<std::uint64_t> words_;
};

inline std::size_t count_common(const SampleBits& a, const SampleBits& b) {
  std::size_t sum = 0;
  for (std::size_t w = 0; w < a.words().size(); ++w) {
    sum += std::popcount(a.words()[w] & b.words()[w]);
  }
  return sum;
}

// How many of the sets hold a sample, counted up to `most`.
inline int times_in(const std::vector<SampleBits>& sets, std::size_t sample, int most) {
  int times = 0;
  for (std::size_t k = 0; k < sets.size() && times < most; ++k) times += sets[k].test(sample);
  return times;
}

}  // namespace organbake
