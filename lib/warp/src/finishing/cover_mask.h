// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstdint>
#include <vector>

#include "organbake/warp/frame.h"
#include "organbake/warp/pixel_box.h"

namespace organbake {

struct PixelAt {
  int x, y;
};

// Which pixels of a box show skin and which the background, one bit each, so that borders, slits
// and holes are found by whole words. Tools are neither.
class CoverMask {
 public:
  static constexpr int kWord = 64;  // pixels

  void read(const PixelBox& box, const Frame& frame);
  // The box and the pixels round it, where its skin ends.
  void read_with_border(const PixelBox& box, const Frame& frame);
  // A pixel of the box that was open is filled.
  void close(PixelAt pixel) {
    const std::size_t word = word_of(pixel);
    const std::uint64_t bit = bit_of(pixel);
    skin_[word] |= bit, open_[word] &= ~bit;
  }

  const PixelBox& box() const { return box_; }
  // False outside the box.
  bool is_skin(PixelAt pixel) const { return has(skin_, pixel); }
  bool is_open(PixelAt pixel) const { return has(open_, pixel); }

  bool operator==(const CoverMask&) const = default;

  int words() const { return words_; }  // of a row
  const std::uint64_t* skin(int y) const { return &skin_[std::size_t(y - box_.y0) * words_]; }
  const std::uint64_t* open(int y) const { return &open_[std::size_t(y - box_.y0) * words_]; }

  // Of a row's word, those one pixel to the right, or the left, of the row's bits.
  std::uint64_t right_of(const std::uint64_t* row, int word) const {
    return row[word] << 1 | (word > 0 ? row[word - 1] >> (kWord - 1) : 0);
  }
  std::uint64_t left_of(const std::uint64_t* row, int word) const {
    return row[word] >> 1 | (word + 1 < words_ ? row[word + 1] << (kWord - 1) : 0);
  }

  // Of a plane of bits that is laid out as these are; false outside the box.
  bool has(const std::vector<std::uint64_t>& bits, PixelAt p) const {
    if (p.x < box_.x0 || p.y < box_.y0 || p.x >= box_.x1 || p.y >= box_.y1) return false;
    return (bits[word_of(p)] & bit_of(p)) != 0;
  }

  // Calls visit(pixel) for each bit of a row's word.
  template <class Visit>
  void for_each(std::uint64_t bits, int word, int y, const Visit& visit) const {
    for (; bits != 0; bits &= bits - 1)
      visit(PixelAt{box_.x0 + word * kWord + std::countr_zero(bits), y});
  }

 private:
  std::size_t word_of(PixelAt p) const {
    return std::size_t(p.y - box_.y0) * words_ + (p.x - box_.x0) / kWord;
  }
  std::uint64_t bit_of(PixelAt p) const { return std::uint64_t{1} << ((p.x - box_.x0) % kWord); }

  PixelBox box_;
  int words_ = 0;
  std::vector<std::uint64_t> skin_, open_;
};

// How many pixels of the box have the cover.
std::size_t count_cover(const Frame& frame, const PixelBox& box, Cover wanted);

}  // namespace organbake
