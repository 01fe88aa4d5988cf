// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/volume/describe.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "organbake/core/text.h"

namespace organbake {
namespace {

char side_towards(const Eigen::Vector3d& axis) {
  Eigen::Index along = 0;
  axis.cwiseAbs().maxCoeff(&along);
  return axis[along] >= 0 ? "LPS"[along] : "RAI"[along];
}

std::string triple(const Eigen::Vector3d& v) {
  return to_text(v.x(), 1) + ", " + to_text(v.y(), 1) + ", " + to_text(v.z(), 1);
}

}  // namespace

VolumeFigures volume_figures(const Volume& volume) {
  VolumeFigures figures;
  figures.size = volume.size;
  figures.spacing_mm = volume.spacing_mm;
  figures.min_mm = figures.max_mm = volume.origin_mm;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d direction = volume.direction.col(axis);
    figures.extent_mm[axis] = volume.size[axis] * volume.spacing_mm[axis];
    figures.orientation += side_towards(direction);
    const double cosine = std::min(1.0, direction.cwiseAbs().maxCoeff());
    figures.oblique_degrees = std::max(figures.oblique_degrees, std::acos(cosine) * 180 / M_PI);
    const Eigen::Vector3d along = direction * volume.spacing_mm[axis] * (volume.size[axis] - 1);
    figures.min_mm += along.cwiseMin(0);
    figures.max_mm += along.cwiseMax(0);
  }
  figures.left_handed = volume.direction.determinant() < 0;
  figures.range = value_range(volume);
  return figures;
}

std::string world_range_text(const Volume& volume) {
  const VolumeFigures f = volume_figures(volume);
  return triple(f.min_mm) + " … " + triple(f.max_mm);
}

}  // namespace organbake
