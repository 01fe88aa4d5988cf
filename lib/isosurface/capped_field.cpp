// SPDX-License-Identifier: GPL-3.0-or-later
#include "isosurface/capped_field.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "isosurface/contour.h"

namespace organbake {
namespace {

constexpr int kLowest = std::numeric_limits<std::int16_t>::min();
constexpr int kHighest = std::numeric_limits<std::int16_t>::max();

bool reaches_border(const Volume& volume, double level) {
  const auto [nx, ny, nz] = volume.size;
  for (int k = 0; k < nz; ++k) {
    const bool outer_slice = k == 0 || k == nz - 1;
    for (int j = 0; j < ny; ++j) {
      const bool whole_row = outer_slice || j == 0 || j == ny - 1;
      const int step = whole_row ? 1 : std::max(1, nx - 1);
      for (int i = 0; i < nx; i += step) {
        if (volume.at(i, j, k) >= level) return true;
      }
    }
  }
  return false;
}

int clamped(int value) { return std::clamp(value, kLowest, kHighest); }
bool inside(int i, int n) { return i >= 0 && i < n; }

}  // namespace

CappedField::CappedField(const Volume& volume, const ValueRange& range, double level, bool cap)
    : volume_(volume), margin_(cap && reaches_border(volume, level) ? 1 : 0) {
  for (int axis = 0; axis < 3; ++axis) size_[axis] = volume.size[axis] + 2 * margin_;
  // Whole numbers are half a unit from the level. A data range far beyond a CT's needs more.
  const double span = static_cast<double>(range.max) - range.min;
  const int least =
      std::max(1, static_cast<int>(std::ceil(span * least_distance_to_level(size_) + 0.5)));
  above_ = static_cast<int>(std::ceil(level + least - 0.5));
  below_ = static_cast<int>(std::floor(level - least + 0.5));
  twice_level_ = static_cast<int>(std::lround(2 * level));
  as_they_are_ = least <= 1;
  air_ = static_cast<std::int16_t>(std::max(kLowest, below_));
}

std::span<const std::int16_t> CappedField::slices(int first, int count,
                                                  std::vector<std::int16_t>& copy) const {
  const std::size_t slice = static_cast<std::size_t>(size_[0]) * size_[1];
  const std::size_t voxels = slice * static_cast<std::size_t>(count);
  if (as_they_are_ && margin_ == 0)
    return std::span(volume_.voxels).subspan(slice * std::size_t(first), voxels);
  copy.resize(voxels);
  tbb::parallel_for(0, count, [&](int k) {
    for (int j = 0; j < size_[1]; ++j) {
      fill_row(j - margin_, first + k - margin_, &copy[(std::size_t(k) * size_[1] + j) * size_[0]]);
    }
  });
  return copy;
}

std::int16_t CappedField::keep_away(int value) const {
  const bool above = 2 * value >= twice_level_;
  return static_cast<std::int16_t>(
      clamped(above ? std::max(value, above_) : std::min(value, below_)));
}

// Air stays air: only tissue is mirrored.
std::int16_t CappedField::mirrored(int value) const {
  const int kept = keep_away(value);
  return 2 * kept < twice_level_ ? air_ : static_cast<std::int16_t>(clamped(twice_level_ - kept));
}

// Row (j, k) of the volume, possibly just outside it. The grid's edges and corners are air.
void CappedField::fill_row(int j, int k, std::int16_t* out) const {
  const auto [nx, ny, nz] = volume_.size;
  const bool j_inside = inside(j, ny), k_inside = inside(k, nz);
  if (!j_inside && !k_inside) {
    std::fill_n(out, size_[0], air_);
    return;
  }
  const std::size_t nearest = std::size_t(std::clamp(k, 0, nz - 1)) * ny + std::clamp(j, 0, ny - 1);
  const std::int16_t* row = &volume_.voxels[nearest * nx];
  const bool is_inside = j_inside && k_inside;
  if (!is_inside) {
    std::transform(row, row + nx, out + margin_, [&](int v) { return mirrored(v); });
  } else if (as_they_are_) {
    std::copy(row, row + nx, out + margin_);
  } else {
    std::transform(row, row + nx, out + margin_, [&](int v) { return keep_away(v); });
  }
  if (margin_ == 0) return;
  out[0] = is_inside ? mirrored(row[0]) : air_;
  out[nx + 1] = is_inside ? mirrored(row[nx - 1]) : air_;
}

}  // namespace organbake
