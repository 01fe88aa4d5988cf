// SPDX-License-Identifier: GPL-3.0-or-later
// What is contoured of a volume whose surface reaches its border: one layer of mirrored values
// closes it half a voxel beyond the last voxels, flat and without a second rule for caps.
#include "capped_field.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <type_traits>
#include <utility>

#include "organbake/contour/contour.h"
#include "organbake/core/parallel.h"

namespace organbake {
namespace {

bool inside(int i, int n) { return i >= 0 && i < n; }

template <typename Value>
Value clamped(double value) {
  using Limits = std::numeric_limits<Value>;
  return static_cast<Value>(std::clamp<double>(value, Limits::lowest(), Limits::max()));
}

// The nearest values to the level, below and above, that VTK's single-precision points tell from
// it.
template <typename Value>
std::pair<Value, Value> nearest_allowed(double level, double least) {
  if constexpr (std::is_integral_v<Value>) {
    // Whole numbers are half a unit from the level. A data range far beyond a CT's needs more.
    const double whole = std::max(1.0, std::ceil(least + 0.5));
    return {clamped<Value>(std::floor(level - whole + 0.5)),
            clamped<Value>(std::ceil(level + whole - 0.5))};
  } else {
    const auto middle = static_cast<Value>(level);
    const Value least_ulp = std::numeric_limits<Value>::epsilon() * std::abs(middle);
    const Value away = std::max(static_cast<Value>(least), least_ulp);
    return {middle - away, middle + away};
  }
}

}  // namespace

template <typename Value>
CappedField<Value>::CappedField(std::span<const Value> values, const std::array<int, 3>& size,
                                const ValueRange& range, double level, bool cap)
    : values_(values), volume_size_(size), level_(level) {
  margin_ = cap && reaches_border() ? 1 : 0;
  for (int axis = 0; axis < 3; ++axis) size_[axis] = size[axis] + 2 * margin_;
  const double least = (range.max - range.min) * least_distance_to_level(size_);
  std::tie(below_, above_) = nearest_allowed<Value>(level, least);
  as_they_are_ = std::is_integral_v<Value> && above_ - below_ <= 1;
  air_ = below_;
  not_measured_ =
      range.min < level ? clamped<Value>(range.min) : clamped<Value>(2 * level - range.max);
}

template <typename Value>
bool CappedField<Value>::reaches_border() const {
  const auto [nx, ny, nz] = volume_size_;
  for (int k = 0; k < nz; ++k) {
    const bool outer_slice = k == 0 || k == nz - 1;
    for (int j = 0; j < ny; ++j) {
      const bool whole_row = outer_slice || j == 0 || j == ny - 1;
      const int step = whole_row ? 1 : std::max(1, nx - 1);
      const std::size_t row = (std::size_t(k) * ny + j) * nx;
      for (int i = 0; i < nx; i += step) {
        if (values_[row + i] >= level_) return true;
      }
    }
  }
  return false;
}

template <typename Value>
std::span<const Value> CappedField<Value>::slices(int first, int count,
                                                  std::vector<Value>& copy) const {
  const std::size_t slice = static_cast<std::size_t>(size_[0]) * size_[1];
  const std::size_t voxels = slice * static_cast<std::size_t>(count);
  if (as_they_are_ && margin_ == 0) return values_.subspan(slice * std::size_t(first), voxels);
  copy.resize(voxels);
  parallel_for(0, count, [&](int k) {
    for (int j = 0; j < size_[1]; ++j) {
      fill_row(j - margin_, first + k - margin_, &copy[(std::size_t(k) * size_[1] + j) * size_[0]]);
    }
  });
  return copy;
}

template <typename Value>
Value CappedField<Value>::keep_away(Value value) const {
  if constexpr (!std::is_integral_v<Value>) {
    if (std::isnan(value)) value = not_measured_;
  }
  return value >= level_ ? std::max(value, above_) : std::min(value, below_);
}

// Air stays air: only tissue is mirrored.
template <typename Value>
Value CappedField<Value>::mirrored(Value value) const {
  const Value kept = keep_away(value);
  return kept < level_ ? air_ : clamped<Value>(2 * level_ - kept);
}

// Row (j, k) of the volume, possibly just outside it. The grid's edges and corners are air.
template <typename Value>
void CappedField<Value>::fill_row(int j, int k, Value* out) const {
  const auto [nx, ny, nz] = volume_size_;
  const bool j_inside = inside(j, ny), k_inside = inside(k, nz);
  if (!j_inside && !k_inside) {
    std::fill_n(out, size_[0], air_);
    return;
  }
  const std::size_t nearest = std::size_t(std::clamp(k, 0, nz - 1)) * ny + std::clamp(j, 0, ny - 1);
  const Value* row = &values_[nearest * nx];
  const bool is_inside = j_inside && k_inside;
  if (!is_inside) {
    std::transform(row, row + nx, out + margin_, [&](Value v) { return mirrored(v); });
  } else if (as_they_are_) {
    std::copy(row, row + nx, out + margin_);
  } else {
    std::transform(row, row + nx, out + margin_, [&](Value v) { return keep_away(v); });
  }
  if (margin_ == 0) return;
  out[0] = is_inside ? mirrored(row[0]) : air_;
  out[nx + 1] = is_inside ? mirrored(row[nx - 1]) : air_;
}

template class CappedField<std::int16_t>;
template class CappedField<float>;

}  // namespace organbake
