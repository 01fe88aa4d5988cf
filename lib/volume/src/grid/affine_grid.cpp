// SPDX-License-Identifier: GPL-3.0-or-later
// A rectangular grid from a file's affine. What is nearly perpendicular is taken as the nearest
// rectangle, what is sheared is resampled to one that holds all of it.
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "grid/grids.h"
#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/core/text.h"
#include "organbake/volume/volume.h"

namespace organbake {
namespace {

// Below this the direction is exact but for the last digits and is left as the file has it.
constexpr double kExact = 1e-12;
constexpr double kSmallestSpacing_mm = 1e-4;
constexpr double kLargestSpacing_mm = 1e4;
constexpr std::int64_t kLargestSide = 65535;
constexpr std::int64_t kMostVoxels = std::int64_t{1} << 31;

// The perpendicular unit vectors nearest to given ones.
Eigen::Matrix3d nearest_perpendicular(const Eigen::Matrix3d& unit) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(unit, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return svd.matrixU() * svd.matrixV().transpose();
}

// Sine of the largest angle by which two axes miss being perpendicular; NaN when one has no length.
double shear_sine(const Eigen::Matrix3d& axes_mm) {
  const Eigen::Matrix3d unit =
      axes_mm * Eigen::Vector3d(axes_mm.colwise().norm()).cwiseInverse().asDiagonal();
  const Eigen::Matrix3d error = unit.transpose() * unit - Eigen::Matrix3d::Identity();
  return error.allFinite() ? error.cwiseAbs().maxCoeff() : std::nan("");
}

}  // namespace

void set_grid(Volume& volume, const Eigen::Matrix3d& axes_mm, const Eigen::Vector3d& origin_mm,
              const std::string& name) {
  if (!axes_mm.allFinite() || !origin_mm.allFinite())
    throw BadDataError(name + ": the affine holds a value that is not finite");
  Eigen::Matrix3d direction;
  for (int axis = 0; axis < 3; ++axis) {
    const double spacing = axes_mm.col(axis).norm();
    if (spacing < kSmallestSpacing_mm || spacing > kLargestSpacing_mm)
      throw BadDataError(name + ": the voxel spacing along axis " + std::to_string(axis) + " is " +
                         to_text(spacing) + " mm");
    volume.spacing_mm[axis] = spacing;
    direction.col(axis) = axes_mm.col(axis) / spacing;
  }
  const Eigen::Matrix3d error = direction.transpose() * direction - Eigen::Matrix3d::Identity();
  const double shear = error.cwiseAbs().maxCoeff();
  if (shear > kLargestShear)
    throw BadDataError(name + ": the volume's axes are sheared by " +
                       to_text(std::asin(std::min(shear, 1.0)) * 180 / M_PI, 2) +
                       "°; resample it to a rectangular grid first");
  volume.direction = shear > kExact ? nearest_perpendicular(direction) : direction;
  volume.origin_mm = origin_mm;
}

std::size_t checked_voxel_count(const std::array<std::int64_t, 3>& size, const std::string& name) {
  std::int64_t count = 1;
  for (const std::int64_t n : size) {
    if (n < 1 || n > kLargestSide)
      throw BadDataError(name + ": a side of " + std::to_string(n) + " voxels; it must be 1…" +
                         std::to_string(kLargestSide));
    count *= n;
  }
  if (count > kMostVoxels)
    throw BadDataError(name + ": " + std::to_string(count) + " voxels are more than the limit of " +
                       std::to_string(kMostVoxels) + "; crop or resample the volume");
  return static_cast<std::size_t>(count);
}

std::size_t set_size(Volume& volume, const std::array<std::int64_t, 3>& size,
                     const std::string& name) {
  const std::size_t voxels = checked_voxel_count(size, name);
  for (std::size_t axis = 0; axis < 3; ++axis) volume.size[axis] = static_cast<int>(size[axis]);
  return voxels;
}

std::size_t set_calculated_size(Volume& volume, const Eigen::Vector3d& size,
                                const std::string& name) {
  constexpr double kFarthest = 1e15;  // beyond any grid, and well within an integer
  std::array<std::int64_t, 3> whole;
  for (int axis = 0; axis < 3; ++axis)
    whole[axis] = std::abs(size[axis]) < kFarthest ? static_cast<std::int64_t>(size[axis]) : -1;
  return set_size(volume, whole, name);
}

namespace {

// sin of 0.5°: about what rounding of whole-degree angles and of float32 quaternions leaves.
constexpr double kNearlyStraight = 8.7e-3;
// sin of 45°: beyond, the numbers are damaged.
constexpr double kMostSheared = 0.7071;

Eigen::Vector3d last_index(const Volume& volume) {
  return {volume.size[0] - 1.0, volume.size[1] - 1.0, volume.size[2] - 1.0};
}

// The nearest rectangular grid, its centre where the file has it.
void set_nearest(Volume& volume, const Eigen::Matrix3d& axes_mm, const Eigen::Vector3d& origin_mm,
                 double degrees, const std::string& name) {
  const Eigen::Matrix3d straight = nearest_perpendicular(axes_mm.colwise().normalized()) *
                                   Eigen::Vector3d(axes_mm.colwise().norm()).asDiagonal();
  const Eigen::Vector3d half = last_index(volume) / 2;
  set_grid(volume, straight, origin_mm + (axes_mm - straight) * half, name);
  double moved_mm = 0;
  for (const Eigen::Vector3d& side : {Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(-1, 1, 1),
                                      Eigen::Vector3d(1, -1, 1), Eigen::Vector3d(1, 1, -1)})
    moved_mm = std::max(moved_mm, ((axes_mm - straight) * half.cwiseProduct(side)).norm());
  volume.warnings.push_back("the volume's axes are sheared by " + to_text(degrees, 2) +
                            "°; the nearest rectangular grid was taken, which moves a voxel by " +
                            to_text(moved_mm, 2) + " mm at most");
}

// The rectangular grid that holds all of a sheared one.
Volume upright_grid(const Volume& stored, const ShearedAffine& affine, const std::string& name) {
  Volume grid;
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::Vector3d along = affine.axes_mm.col(axis);
    for (int before = 0; before < axis; ++before)
      along -= grid.direction.col(before).dot(along) * grid.direction.col(before);
    grid.spacing_mm[axis] = along.norm();
    grid.direction.col(axis) = along.normalized();
  }
  grid.origin_mm = affine.origin_mm;
  Eigen::Vector3d low = Eigen::Vector3d::Zero(), high = low;
  for (const Eigen::Vector3d& corner : corners_of(low, last_index(stored))) {
    const Eigen::Vector3d world = affine.origin_mm + affine.axes_mm * corner;
    low = low.cwiseMin(grid.index_from_world(world));
    high = high.cwiseMax(grid.index_from_world(world));
  }
  constexpr double kRoundingSlack = 1e-6;  // of a voxel
  low = (low.array() + kRoundingSlack).floor();
  high = (high.array() - kRoundingSlack).ceil();
  const Eigen::Vector3d count = high - low + Eigen::Vector3d::Ones();
  // However long and thin a volume is, what a scanner shears stays of its own size.
  constexpr std::size_t kMostGrowth = 16, kAlwaysFits = 100'000;
  if (set_calculated_size(grid, count, name) >
      std::max(kMostGrowth * stored.voxel_count(), kAlwaysFits))
    throw BadDataError(name + ": its axes are sheared so that no grid of its size holds it");
  grid.origin_mm = grid.world_from_index(low);
  return grid;
}

// Linear between the eight voxels round a place whose nearest voxel lies in the volume; those
// beyond its border count as the border's.
double linear_at(const Volume& volume, const Eigen::Vector3d& index) {
  std::array<int, 3> low, high;
  Eigen::Vector3d share;
  for (int axis = 0; axis < 3; ++axis) {
    const int last = volume.size[axis] - 1;
    const double floor = std::floor(index[axis]);
    share[axis] = index[axis] - floor;
    low[axis] = std::clamp(static_cast<int>(floor), 0, last);
    high[axis] = std::clamp(static_cast<int>(floor) + 1, 0, last);
  }
  double value = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const bool x = corner & 1, y = corner >> 1 & 1, z = corner >> 2 & 1;
    value += (x ? share.x() : 1 - share.x()) * (y ? share.y() : 1 - share.y()) *
             (z ? share.z() : 1 - share.z()) *
             volume.at(x ? high[0] : low[0], y ? high[1] : low[1], z ? high[2] : low[2]);
  }
  return value;
}

Volume resampled(const Volume& stored, const ShearedAffine& affine, bool is_mask,
                 const std::string& name) {
  Volume grid = upright_grid(stored, affine, name);
  const double outside = is_mask ? 0 : stored.is_real() ? std::nan("") : value_range(stored).min;
  const Eigen::Matrix3d index_from_world = affine.axes_mm.inverse();
  const Eigen::Matrix3d linear = index_from_world * grid.direction * grid.spacing_mm.asDiagonal();
  const Eigen::Vector3d first = index_from_world * (grid.origin_mm - affine.origin_mm);
  const std::size_t count = IndexBox::whole(grid).voxels();
  if (stored.is_real()) {
    grid.reals.assign(count, static_cast<float>(outside));
  } else {
    grid.voxels.assign(count, static_cast<std::int16_t>(outside));
  }
  parallel_for(0, grid.size[2], [&](int k) {
    std::size_t voxel = std::size_t(k) * grid.size[0] * grid.size[1];
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i, ++voxel) {
        const Eigen::Vector3d index = linear * Eigen::Vector3d(i, j, k) + first;
        const std::optional<Eigen::Vector3i> nearest = nearest_voxel(stored, index);
        if (!nearest) continue;
        set_value(grid, voxel,
                  is_mask ? stored.at(nearest->x(), nearest->y(), nearest->z())
                          : linear_at(stored, index));
      }
    }
  });
  return grid;
}

}  // namespace

Shear set_grid_or_shear(Volume& volume, const Eigen::Matrix3d& axes_mm,
                        const Eigen::Vector3d& origin_mm, const std::string& name) {
  const double sine = shear_sine(axes_mm);
  // set_grid() takes what is straight, and says what is no affine at all.
  if (!(sine > kLargestShear && sine <= kMostSheared) || !origin_mm.allFinite()) {
    set_grid(volume, axes_mm, origin_mm, name);
    return {};
  }
  const double degrees = std::asin(std::min(sine, 1.0)) * 180 / M_PI;
  if (sine <= kNearlyStraight) {
    set_nearest(volume, axes_mm, origin_mm, degrees, name);
    return {};
  }
  return ShearedAffine{axes_mm, origin_mm, degrees};
}

Volume straightened(Volume stored, const Shear& shear, const VolumeReadOptions& options,
                    const std::string& name) {
  if (!shear) return stored;
  Volume grid = resampled(stored, *shear, options.is_mask, name);
  grid.warnings = std::move(stored.warnings);
  grid.label_names = std::move(stored.label_names);
  grid.time_points = stored.time_points;
  grid.warnings.push_back("the volume's axes are sheared by " + to_text(shear->degrees, 1) +
                          "°; it was resampled to a rectangular grid");
  return within_region(std::move(grid), options, name);
}

Volume within_region(Volume volume, const VolumeReadOptions& options, const std::string& name) {
  if (!options.region) return volume;
  const IndexBox box = voxels_of_region(volume, *options.region, name);
  return cropped(std::move(volume), box);
}

}  // namespace organbake
