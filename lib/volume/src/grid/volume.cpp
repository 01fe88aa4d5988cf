// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/volume/volume.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <type_traits>

#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/geometry/rigid_transform.h"

namespace organbake {
namespace {

// Directions come from decimal text or float32; a hundredth of a degree moves a voxel by 0.05 mm
// at 300 mm.
constexpr double kOrthonormalTolerance = 2e-4;
// Beyond these no scan was made: the header is damaged, or its units are others.
constexpr double kLeastSpacing_mm = 1e-6, kMostSpacing_mm = 1e6;

std::string in_voxels(const std::array<int, 3>& size) {
  return std::to_string(size[0]) + "×" + std::to_string(size[1]) + "×" + std::to_string(size[2]);
}

}  // namespace

void make_real(Volume& volume) {
  if (volume.is_real()) return;
  volume.reals.assign(volume.voxels.begin(), volume.voxels.end());
  volume.voxels = {};
}

void make_labels(Volume& volume) {
  if (!volume.is_real()) return;
  std::size_t not_whole = 0;
  for (float& value : volume.reals) {
    const float whole = std::isnan(value) ? 0 : std::nearbyint(value);
    not_whole += std::abs(value - whole) > 0;
    value = whole;
  }
  if (not_whole > 0) {
    volume.warnings.push_back(std::to_string(not_whole) + " of " +
                              std::to_string(volume.voxel_count()) +
                              " voxels are no whole numbers; each was taken as the nearest label");
  }
  const ValueRange range = value_range(volume);
  if (range.max > kMostLabel) {
    volume.warnings.push_back("labels beyond " + std::to_string(kMostLabel) +
                              " cannot be told apart");
  }
  if (range.min < std::numeric_limits<std::int16_t>::min() ||
      range.max > std::numeric_limits<std::int16_t>::max()) {
    return;
  }
  volume.voxels.resize(volume.reals.size());
  std::transform(volume.reals.begin(), volume.reals.end(), volume.voxels.begin(),
                 [](float label) { return static_cast<std::int16_t>(label); });
  volume.reals = {};
}

ValueRange value_range(const Volume& volume) {
  return with_values(volume, [](const auto values) {
    using Value = typename std::remove_cvref_t<decltype(values)>::value_type;
    using Limits = std::numeric_limits<Value>;
    struct Found {
      Value low = Limits::max(), high = Limits::lowest();
      bool has_nan = false;
    };
    constexpr std::size_t kGrain = std::size_t{1} << 20;
    const Found found = tbb::parallel_reduce(
        tbb::blocked_range<std::size_t>(0, values.size(), kGrain), Found(),
        [&](const auto& block, Found so_far) {
          // Two plain loops' worth of min and max, which compilers vectorise; minmax_element is
          // branchy. A NaN is never less.
          Value low = so_far.low, high = so_far.high;
          bool has_nan = so_far.has_nan;
          for (std::size_t i = block.begin(); i < block.end(); ++i) {
            low = values[i] < low ? values[i] : low;
            high = high < values[i] ? values[i] : high;
            if constexpr (Limits::has_quiet_NaN) has_nan |= values[i] != values[i];
          }
          return Found{low, high, has_nan};
        },
        [](const Found& a, const Found& b) {
          return Found{std::min(a.low, b.low), std::max(a.high, b.high), a.has_nan || b.has_nan};
        });
    if (found.high < found.low) return ValueRange{0, 0, found.has_nan};
    return ValueRange{static_cast<double>(found.low), static_cast<double>(found.high),
                      found.has_nan};
  });
}

std::vector<LabelCount> count_labels(const Volume& volume) {
  std::map<int, std::size_t> counts;
  with_values(volume, [&](const auto values) {
    for (std::size_t at = 0; at < values.size();) {
      std::size_t end = at + 1;
      while (end < values.size() && values[end] == values[at]) ++end;
      if (std::isfinite(static_cast<float>(values[at]))) counts[int(values[at])] += end - at;
      at = end;
    }
  });
  counts.erase(0);
  std::vector<LabelCount> labels;
  for (const auto& [label, voxels] : counts) labels.push_back({label, voxels});
  return labels;
}

void check_volume(const Volume& volume, const std::string& name) {
  std::size_t expected = 1;
  for (const int n : volume.size) {
    if (n < 1) throw BadDataError(name + ": a volume of " + in_voxels(volume.size) + " voxels");
    expected *= static_cast<std::size_t>(n);
  }
  if (volume.voxel_count() != expected) {
    throw BadDataError(name + ": " + std::to_string(volume.voxel_count()) + " values for " +
                       in_voxels(volume.size) + " voxels");
  }
  for (int axis = 0; axis < 3; ++axis) {
    const double spacing = volume.spacing_mm[axis];
    if (!(spacing >= kLeastSpacing_mm && spacing <= kMostSpacing_mm)) {
      throw BadDataError(name + ": the voxel spacing along axis " + std::to_string(axis) + " is " +
                         to_text(spacing) + " mm; it must be in 1e-6…1e6");
    }
  }
  const Eigen::Matrix3d& d = volume.direction;
  if (!d.allFinite() || !within_reach(volume.origin_mm)) {
    throw BadDataError(name +
                       ": the volume's direction is not finite, or its origin is not within "
                       "1e9 mm");
  }
  if ((d.transpose() * d - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() >
      kOrthonormalTolerance) {
    throw BadDataError(name + ": the volume's axes are not perpendicular unit vectors");
  }
}

std::vector<double> slice_gaps_mm(const Volume& volume) {
  std::vector<double> gaps;
  const std::vector<Eigen::Vector3d>& corners = volume.slices.corners_mm;
  for (std::size_t k = 1; k < corners.size(); ++k)
    gaps.push_back((corners[k] - corners[k - 1]).dot(volume.direction.col(2)));
  return gaps;
}

bool same_grid(const Volume& a, const Volume& b) {
  if (a.size != b.size) return false;
  const double tolerance = 0.01 * std::min(a.spacing_mm.minCoeff(), b.spacing_mm.minCoeff());
  // The eight corners bound every voxel between them.
  for (int corner = 0; corner < 8; ++corner) {
    Eigen::Vector3d index;
    for (int axis = 0; axis < 3; ++axis) {
      index[axis] = (corner >> axis & 1) ? a.size[axis] - 1 : 0;
    }
    if ((a.world_from_index(index) - b.world_from_index(index)).norm() > tolerance) return false;
  }
  return true;
}

}  // namespace organbake
