// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "organbake/warp/frame.h"
#include "picture/spans.h"
#include "picture/tiles.h"

namespace organbake {

struct PixelAt {
  int x, y;
};

// Which pixels of a box show skin and which the background, one bit each, so that borders, slits
// are found by whole words. Tools are neither.
class CoverMask {
 public:
  static constexpr int kWord = 64;  // pixels

  // Of a box and the pixels round it, where its skin ends.
  void read(const PixelBox& within, const Frame& frame);
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

// No smooth skin falls this far from one pixel to the next, and then goes on level or rises again.
inline constexpr float kStepTexels = 8;

// Between which neighbouring pixels skin ends: one of the two shows skin, the other the background
// or skin that lies behind. One bit for each pair, so that whole words are looked through at once.
class FrontEdges {
 public:
  // Which pixel of a pair is in front: the left or upper one, or the other.
  enum Front : int { first, second };
  // Whether the pixels of a pair lie in a row, or in a column.
  enum Along : int { row, column };

  // Of the background; and, where depths are known, of skin at least deeper_mm behind, where it is
  // no slope: where neither side falls as fast.
  void find(const CoverMask& skin, const SkinDepth* depth = nullptr, float deeper_mm = 0);

  bool empty() const { return !skin_ || skin_->box().empty(); }
  const CoverMask& skin() const { return *skin_; }

  // Bits of the pairs whose left or upper pixel is in the box's row y.
  const std::uint64_t* of_row(Along along, Front front, int y) const {
    return &planes_[along][front][std::size_t(y - skin_->box().y0) * skin_->words()];
  }
  // Of two neighbours; false outside the box.
  bool in_front(PixelAt pixel, PixelAt other) const;
  // By the pair's left or upper pixel.
  bool has(Along along, Front front, PixelAt pair) const {
    return skin_->has(planes_[along][front], pair);
  }

 private:
  void find_borders(int y);
  void find_steps(const SkinDepth& depth, SkinDepth::Level deeper, Along along, int y);

  const CoverMask* skin_ = nullptr;
  std::array<std::array<std::vector<std::uint64_t>, 2>, 2> planes_;
};

// Between two terraces of a CT's slices, seen more from the side than any camera saw them, single
// pixels look through the skin at whatever lies behind. A covered pixel that lies deeper_mm behind
// the nearer of two pixels on either side, along its row or its column, is one: made background,
// the slits' filling closes it. `depth` is looked at in the box and round it. Returns
// the pixels' numbers in the picture, ascending.
std::vector<std::uint32_t> find_see_through(const PixelBox& box, const SkinDepth& depth,
                                            float deeper_mm);

}  // namespace organbake
