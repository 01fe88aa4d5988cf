// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
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

// A block of the picture's pixels, and the solids that may be seen in it.
struct SolidBlock {
  PixelBox box;
  std::vector<std::uint32_t> solids;
};

// All blocks that the solids may touch.
std::vector<SolidBlock> solid_blocks(const std::vector<Solid>& solids, const View& view);

// Draws solids lit from the eye into their blocks of a frame that keeps its depth, hidden where
// tissue is nearer; edges are smoothed with 2 × 2 rays a pixel. Returns the pixels touched.
std::size_t draw_solids(const std::vector<Solid>& solids, const std::vector<SolidBlock>& blocks,
                        const View& view, Frame& frame);

}  // namespace organbake
