// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "volume/volume.h"

namespace organbake {

// What is contoured, a few slices at a time: the volume's own voxels, or a copy of those slices
// where they must differ. With `cap`, a volume that the surface would leave through its border gets
// one voxel of air around it, each the mirror image of its neighbour at the level: the crossing
// then falls half-way, on the outer side of the last voxel, so the cap is flat and the voxels keep
// their whole thickness. The volume must outlive the field.
class CappedField {
 public:
  // `level` is a half-integer.
  CappedField(const Volume& volume, const ValueRange& range, double level, bool cap);

  const std::array<int, 3>& size() const { return size_; }
  int margin() const { return margin_; }  // voxels added on every side
  // The values of slices [first, first + count) of the field; they may lie in `copy`.
  std::span<const std::int16_t> slices(int first, int count, std::vector<std::int16_t>& copy) const;

 private:
  void fill_row(int j, int k, std::int16_t* out) const;
  std::int16_t keep_away(int value) const;
  std::int16_t mirrored(int value) const;

  const Volume& volume_;
  std::array<int, 3> size_{};
  int margin_ = 0;
  int above_ = 0, below_ = 0;  // the nearest values to the level that are allowed
  int twice_level_ = 0;
  bool as_they_are_ = false;  // inside the volume no value is too near to the level
  std::int16_t air_ = 0;
};

}  // namespace organbake
