// SPDX-License-Identifier: GPL-3.0-or-later
#include "volume/volume.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/text.h"
#include "geometry/reach.h"

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

ValueRange value_range(const Volume& volume) {
  if (volume.voxels.empty()) return {};
  const ValueRange first = {volume.voxels.front(), volume.voxels.front()};
  constexpr std::size_t kGrain = std::size_t{1} << 20;
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, volume.voxels.size(), kGrain), first,
      [&](const auto& block, ValueRange range) {
        // Two plain loops' worth of min and max, which compilers vectorise; minmax_element is
        // branchy.
        auto low = static_cast<std::int16_t>(range.min),
             high = static_cast<std::int16_t>(range.max);
        for (std::size_t i = block.begin(); i < block.end(); ++i) {
          low = std::min(low, volume.voxels[i]);
          high = std::max(high, volume.voxels[i]);
        }
        return ValueRange{low, high};
      },
      [](const ValueRange& a, const ValueRange& b) {
        return ValueRange{std::min(a.min, b.min), std::max(a.max, b.max)};
      });
}

std::vector<LabelCount> count_labels(const Volume& volume) {
  constexpr int kOffset = 32768;
  std::vector<std::size_t> histogram(65536, 0);
  for (const std::int16_t v : volume.voxels) ++histogram[static_cast<std::size_t>(v + kOffset)];
  std::vector<LabelCount> labels;
  for (int i = 0; i < 65536; ++i) {
    if (histogram[i] > 0 && i != kOffset) labels.push_back({i - kOffset, histogram[i]});
  }
  return labels;
}

void check_volume(const Volume& volume, const std::string& name) {
  std::size_t expected = 1;
  for (const int n : volume.size) {
    if (n < 1) throw BadDataError(name + ": a volume of " + in_voxels(volume.size) + " voxels");
    expected *= static_cast<std::size_t>(n);
  }
  if (volume.voxels.size() != expected) {
    throw BadDataError(name + ": " + std::to_string(volume.voxels.size()) + " values for " +
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
