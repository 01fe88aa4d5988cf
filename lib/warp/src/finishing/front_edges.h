// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "finishing/cover_mask.h"
#include "picture/skin_depth.h"

namespace organbake {

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

  // Of the background alone.
  void find(const CoverMask& skin);
  // And of skin at least deeper_mm behind, where it is no slope: where neither side falls as fast.
  void find(const CoverMask& skin, const SkinDepth& depth, float deeper_mm);

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
  template <class AddSteps>
  void find_rows(const CoverMask& skin, const AddSteps& add_steps);
  void find_borders(int y);
  void find_steps(const SkinDepth& depth, SkinDepth::Level deeper, Along along, int y);

  const CoverMask* skin_ = nullptr;
  std::array<std::array<std::vector<std::uint64_t>, 2>, 2> planes_;
};

}  // namespace organbake
