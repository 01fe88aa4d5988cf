// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "organbake/volume/volume.h"

namespace organbake {

// One label of a mask: what a person chooses by.
struct LabelFigures {
  int label = 0;
  std::string name;  // empty when the file has none
  std::size_t voxels = 0;
  double volume_ml = 0;
  Eigen::Vector3d min_mm = Eigen::Vector3d::Zero();  // box of its voxels' centres, LPS
  Eigen::Vector3d max_mm = Eigen::Vector3d::Zero();
};

// Few values, none below 0, or named ones: labels, and no CT.
bool looks_like_mask(const Volume& volume);

// Every label that voxels have, in increasing order, without the background 0.
std::vector<LabelFigures> label_figures(const Volume& mask);

// "5 liver: 1043.1 ml, 38634 voxels, (…, …, …)…(…, …, …) mm"
std::string label_line(const LabelFigures& figures);

}  // namespace organbake
