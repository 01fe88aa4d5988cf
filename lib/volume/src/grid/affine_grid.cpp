// SPDX-License-Identifier: GPL-3.0-or-later
#include "grid/affine_grid.h"

#include <Eigen/SVD>
#include <cmath>

#include "organbake/core/error.h"
#include "organbake/core/text.h"

namespace organbake {
namespace {

// Below this the direction is exact but for the last digits and is left as the file has it.
constexpr double kExact = 1e-12;
constexpr double kSmallestSpacing_mm = 1e-4;
constexpr double kLargestSpacing_mm = 1e4;
constexpr std::int64_t kLargestSide = 65535;
constexpr std::int64_t kMostVoxels = std::int64_t{1} << 31;

}  // namespace

double shear_sine(const Eigen::Matrix3d& axes_mm) {
  const Eigen::Matrix3d unit =
      axes_mm * Eigen::Vector3d(axes_mm.colwise().norm()).cwiseInverse().asDiagonal();
  const Eigen::Matrix3d error = unit.transpose() * unit - Eigen::Matrix3d::Identity();
  return error.allFinite() ? error.cwiseAbs().maxCoeff() : std::nan("");
}

void set_grid(Volume& volume, const Eigen::Matrix3d& axes_mm, const Eigen::Vector3d& origin_mm,
              const std::string& name) {
  if (!axes_mm.allFinite() || !origin_mm.allFinite()) {
    throw BadDataError(name + ": the affine holds a value that is not finite");
  }
  Eigen::Matrix3d direction;
  for (int axis = 0; axis < 3; ++axis) {
    const double spacing = axes_mm.col(axis).norm();
    if (spacing < kSmallestSpacing_mm || spacing > kLargestSpacing_mm) {
      throw BadDataError(name + ": the voxel spacing along axis " + std::to_string(axis) + " is " +
                         to_text(spacing) + " mm");
    }
    volume.spacing_mm[axis] = spacing;
    direction.col(axis) = axes_mm.col(axis) / spacing;
  }
  const Eigen::Matrix3d error = direction.transpose() * direction - Eigen::Matrix3d::Identity();
  const double shear = error.cwiseAbs().maxCoeff();
  if (shear > kLargestShear) {
    throw BadDataError(name + ": the volume's axes are sheared by " +
                       to_text(std::asin(std::min(shear, 1.0)) * 180 / M_PI, 2) +
                       "°; resample it to a rectangular grid first");
  }
  if (shear > kExact) {
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(direction,
                                                Eigen::ComputeFullU | Eigen::ComputeFullV);
    direction = svd.matrixU() * svd.matrixV().transpose();
  }
  volume.direction = direction;
  volume.origin_mm = origin_mm;
}

std::size_t checked_voxel_count(const std::array<std::int64_t, 3>& size, const std::string& name) {
  std::int64_t count = 1;
  for (const std::int64_t n : size) {
    if (n < 1 || n > kLargestSide) {
      throw BadDataError(name + ": a side of " + std::to_string(n) + " voxels; it must be 1…" +
                         std::to_string(kLargestSide));
    }
    count *= n;
  }
  if (count > kMostVoxels) {
    throw BadDataError(name + ": " + std::to_string(count) + " voxels are more than the limit of " +
                       std::to_string(kMostVoxels) + "; crop or resample the volume");
  }
  return static_cast<std::size_t>(count);
}

std::size_t checked_grid_size(const Eigen::Vector3d& size, const std::string& name) {
  constexpr double kFarthest = 1e15;  // beyond any grid, and well within an integer
  std::array<std::int64_t, 3> whole;
  for (int axis = 0; axis < 3; ++axis)
    whole[axis] = std::abs(size[axis]) < kFarthest ? static_cast<std::int64_t>(size[axis]) : -1;
  return checked_voxel_count(whole, name);
}

}  // namespace organbake
