// SPDX-License-Identifier: GPL-3.0-or-later
// How coarse the grid was that a mask was drawn on, read off the heights of the steps in its
// surface: a histogram of height differences between neighbouring columns has no entry below that
// grid's spacing.
#include "mask_stairs.h"

#include <algorithm>
#include <cstdint>
#include <vector>

#include "organbake/core/parallel.h"

namespace organbake {
namespace {

constexpr int kHighestStep = 8;
// Slopes below 45° alone make more than half of all steps 1 high on a mask's own grid. Stray voxels
// of a resampled mask make a few per cent.
constexpr double kShareOfLowSteps = 0.25;

using StepCounts = std::array<std::size_t, kHighestStep + 1>;

class LabelSteps {
 public:
  LabelSteps(const Volume& mask, int label, const LabelBox& box)
      : size_(box.size), inside_(std::size_t(box.size[0]) * box.size[1] * box.size[2]) {
    with_values(mask, [&](const auto values) {
      parallel_for(0, size_[2], [&](int k) {
        for (int j = 0; j < size_[1]; ++j) {
          const auto* from =
              values.data() +
              (std::size_t(k + box.first[2]) * mask.size[1] + j + box.first[1]) * mask.size[0] +
              box.first[0];
          std::uint8_t* const row = &inside_[place({0, j, k})];
          for (int i = 0; i < size_[0]; ++i) row[i] = from[i] == label;
        }
      });
    });
  }

  int typical_height(int axis) const {
    std::vector<StepCounts> of_slices(static_cast<std::size_t>(size_[2]));
    parallel_for(0, size_[2],
                 [&](int k) { of_slices[static_cast<std::size_t>(k)] = count_steps(axis, k); });
    StepCounts counts{};
    for (const StepCounts& slice : of_slices) {
      for (int height = 0; height <= kHighestStep; ++height) counts[height] += slice[height];
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
  std::size_t place(const Index& at) const {
    return (static_cast<std::size_t>(at[2]) * size_[1] + at[1]) * size_[0] + at[0];
  }
  bool is_label(const Index& at) const {
    for (int axis = 0; axis < 3; ++axis) {
      if (at[axis] < 0 || at[axis] >= size_[axis]) return false;
    }
    return inside_[place(at)] != 0;
  }
  StepCounts count_steps(int axis, int k) const {
    StepCounts counts{};
    Index at = {0, 0, k};
    for (at[1] = 0; at[1] < size_[1]; ++at[1]) {
      const std::uint8_t* const row = &inside_[place({0, at[1], k})];
      for (at[0] = 0; at[0] < size_[0]; ++at[0]) {
        if (!row[at[0]] || is_label(moved(at, axis, 1))) continue;
        for (int other = 0; other < 3; ++other) {
          if (other != axis) ++counts[step_to(moved(at, other, 1), axis)];
        }
      }
    }
    return counts;
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

  std::array<int, 3> size_;
  std::vector<std::uint8_t> inside_;  // the label's box, x fastest
};

}  // namespace

Eigen::Vector3d stair_height_voxels(const Volume& mask, int label, const LabelBox& box) {
  const LabelSteps steps(mask, label, box);
  return {static_cast<double>(steps.typical_height(0)),
          static_cast<double>(steps.typical_height(1)),
          static_cast<double>(steps.typical_height(2))};
}

}  // namespace organbake
