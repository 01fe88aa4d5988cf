// SPDX-License-Identifier: GPL-3.0-or-later
// How coarse the grid was that a mask was drawn on, read off the heights of the steps in its
// surface: a histogram of height differences between neighbouring columns has no entry below that
// grid's spacing.
#include "mask_stairs.h"

#include <algorithm>

namespace organbake {
namespace {

constexpr int kHighestStep = 8;
// Slopes below 45° alone make more than half of all steps 1 high on a mask's own grid. Stray voxels
// of a resampled mask make a few per cent.
constexpr double kShareOfLowSteps = 0.25;

class LabelSteps {
 public:
  LabelSteps(const Volume& mask, int label, const LabelBox& box)
      : mask_(mask), label_(label), box_(box) {}

  int typical_height(int axis) const {
    std::array<std::size_t, kHighestStep + 1> counts{};
    std::array<int, 3> at;
    for (at[2] = 0; at[2] < box_.size[2]; ++at[2]) {
      for (at[1] = 0; at[1] < box_.size[1]; ++at[1]) {
        for (at[0] = 0; at[0] < box_.size[0]; ++at[0]) {
          if (!is_label(at) || is_label(moved(at, axis, 1))) continue;
          for (int other = 0; other < 3; ++other) {
            if (other != axis) ++counts[step_to(moved(at, other, 1), axis)];
          }
        }
      }
    }
    std::size_t steps = 0, low = 0;
    for (int height = 1; height <= kHighestStep; ++height) steps += counts[height];
    for (int height = 1; height <= kHighestStep; ++height) {
      low += counts[height];
      if (static_cast<double>(low) >= kShareOfLowSteps * static_cast<double>(steps) && low > 0) {
        return height;
      }
    }
    return 1;  // a box has no steps at all
  }

 private:
  using Index = std::array<int, 3>;

  static Index moved(Index at, int axis, int by) {
    at[axis] += by;
    return at;
  }
  bool is_label(const Index& at) const {
    for (int axis = 0; axis < 3; ++axis) {
      if (at[axis] < 0 || at[axis] >= box_.size[axis]) return false;
    }
    return mask_.at(at[0] + box_.first[0], at[1] + box_.first[1], at[2] + box_.first[2]) == label_;
  }
  // Height difference between a column's top and the nearest top of the column beside it, where
  // `next` is at the height of the first; 0 when they are level or there is none near.
  std::size_t step_to(const Index& next, int axis) const {
    const bool up = is_label(next);
    for (int height = 0; height <= kHighestStep; ++height) {
      if (is_label(moved(next, axis, up ? height + 1 : -height)) != up) {
        return static_cast<std::size_t>(height);
      }
    }
    return 0;
  }

  const Volume& mask_;
  int label_;
  const LabelBox& box_;
};

}  // namespace

Eigen::Vector3d stair_height_voxels(const Volume& mask, int label, const LabelBox& box) {
  const LabelSteps steps(mask, label, box);
  return {static_cast<double>(steps.typical_height(0)),
          static_cast<double>(steps.typical_height(1)),
          static_cast<double>(steps.typical_height(2))};
}

}  // namespace organbake
