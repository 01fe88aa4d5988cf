// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "warp/frame.h"
#include "warp/pixel_box.h"
#include "warp/view.h"

namespace organbake {

// An instrument's part as a capsule (a sphere when both ends agree), world millimetres.
struct Solid {
  Eigen::Vector3d from = Eigen::Vector3d::Zero();
  Eigen::Vector3d to = Eigen::Vector3d::Zero();
  double radius_mm = 1;
  Eigen::Vector3f color = Eigen::Vector3f::Constant(0.35f);  // linear

  bool operator==(const Solid& other) const = default;
};

// All pixels that the solids may touch, clipped to the view.
PixelBox solids_box(const std::vector<Solid>& solids, const View& view);

// Draws solids lit from the eye into a frame that keeps its depth, hidden where tissue is nearer;
// edges are smoothed with 2 × 2 rays a pixel. Returns the pixels touched.
std::size_t draw_solids(const std::vector<Solid>& solids, const View& view, Frame& frame);

}  // namespace organbake
