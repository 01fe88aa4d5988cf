// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>

#include "organbake/volume/volume.h"

namespace organbake {

// The figures of a volume that `inspect` prints.
struct VolumeFigures {
  std::array<int, 3> size{};
  Eigen::Vector3d spacing_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d extent_mm = Eigen::Vector3d::Zero();  // size ∘ spacing
  Eigen::Vector3d min_mm = Eigen::Vector3d::Zero();     // of the voxel centres, LPS
  Eigen::Vector3d max_mm = Eigen::Vector3d::Zero();
  // The patient's side that each index axis runs towards: "LPS" for a plain axial CT, "LAS" for
  // one with its rows from posterior to anterior. (ITK names the sides it comes from: "RAI".)
  std::string orientation;
  double oblique_degrees = 0;  // largest angle between an index axis and a patient axis
  bool left_handed = false;
  ValueRange range;
};

VolumeFigures volume_figures(const Volume& volume);

// "-149.5, -61.5, -842.5 … 249.5, …": the box of the voxel centres in world millimetres.
std::string world_range_text(const Volume& volume);

}  // namespace organbake
