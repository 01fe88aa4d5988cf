// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "organbake/volume/volume.h"

namespace organbake {

// What is contoured, a few slices at a time: the volume's own voxels, or a copy of those slices
// where they must differ. With `cap`, a volume that the surface would leave through its border gets
// one voxel of air around it, each the mirror image of its neighbour at the level: the crossing
// then falls half-way, on the outer side of the last voxel, so the cap is flat and the voxels keep
// their whole thickness. What is NaN is air. The values must outlive the field.
template <typename Value>
class CappedField {
 public:
  // `level` is a half-integer when the values are whole numbers.
  CappedField(std::span<const Value> values, const std::array<int, 3>& size,
              const ValueRange& range, double level, bool cap);

  const std::array<int, 3>& size() const { return size_; }
  double level() const { return level_; }
  int margin() const { return margin_; }  // voxels added on every side
  // The values of slices [first, first + count) of the field; they may lie in `copy`.
  std::span<const Value> slices(int first, int count, std::vector<Value>& copy) const;

 private:
  bool reaches_border() const;
  void fill_row(int j, int k, Value* out) const;
  Value keep_away(Value value) const;
  Value mirrored(Value value) const;

  std::span<const Value> values_;
  std::array<int, 3> volume_size_;
  std::array<int, 3> size_{};
  double level_;
  int margin_ = 0;
  Value above_ = 0, below_ = 0;  // the nearest values to the level that are allowed
  bool as_they_are_ = false;     // inside the volume no value is too near to the level
  Value air_ = 0;
  Value not_measured_ = 0;  // what stands for NaN
};

}  // namespace organbake
