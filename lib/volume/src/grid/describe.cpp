// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/volume/describe.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "organbake/core/text.h"
#include "organbake/volume/label_figures.h"

namespace organbake {
namespace {

char side_towards(const Eigen::Vector3d& axis) {
  Eigen::Index along = 0;
  axis.cwiseAbs().maxCoeff(&along);
  return axis[along] >= 0 ? "LPS"[along] : "RAI"[along];
}

std::string triple(const Eigen::Vector3d& v, int digits, const char* between) {
  return to_text(v.x(), digits) + between + to_text(v.y(), digits) + between +
         to_text(v.z(), digits);
}

std::string labels_line(const Volume& volume) {
  const std::vector<LabelCount> labels = count_labels(volume);
  constexpr std::size_t kShown = 12;
  std::string line = "labels       " + std::to_string(labels.size()) + ":";
  const double voxel_ml = volume.spacing_mm.prod() / 1000;
  for (std::size_t i = 0; i < std::min(labels.size(), kShown); ++i) {
    line += (i ? ", " : " ") + std::to_string(labels[i].label) + " (" +
            to_text(static_cast<double>(labels[i].voxels) * voxel_ml, 1) + " ml)";
  }
  return line + (labels.size() > kShown ? ", …\n" : "\n");
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
  return triple(f.min_mm, 1, ", ") + " … " + triple(f.max_mm, 1, ", ");
}

std::string describe_volume(const Volume& volume) {
  const VolumeFigures f = volume_figures(volume);
  std::string text = "size         " + std::to_string(f.size[0]) + "×" + std::to_string(f.size[1]) +
                     "×" + std::to_string(f.size[2]) + " voxels\n";
  text += "spacing      " + triple(f.spacing_mm, 3, " × ") + " mm\n";
  text += "extent       " + triple(f.extent_mm, 1, " × ") + " mm\n";
  text += "centres      " + world_range_text(volume) + " mm (LPS)\n";
  text += "orientation  " + f.orientation;
  constexpr double kWorthTelling = 0.05;
  if (f.oblique_degrees > kWorthTelling)
    text += ", oblique by " + to_text(f.oblique_degrees, 1) + "°";
  text += f.left_handed ? ", left-handed\n" : "\n";
  text += "values       " + to_text(f.range.min) + "…" + to_text(f.range.max) + "\n";
  if (looks_like_mask(volume)) text += labels_line(volume);
  for (const std::string& warning : volume.warnings) text += "warning      " + warning + "\n";
  return text;
}

}  // namespace organbake
