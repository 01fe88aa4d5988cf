// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "organbake/geometry/camera.h"
#include "organbake/shading/grid.h"

namespace organbake {

// Depths that were found, beside the true ones of the same pixels, of as many frames as one scale
// is to hold for. Depths are planar; +inf and 0 = none.
struct DepthPairs {
  std::vector<float> found, truth;
  std::size_t asked = 0;  // pixels that have a true depth

  void add(float found_depth, float true_depth);
  // Two maps of one view, of sizes in proportion: the pixels of the one that was found.
  void add_maps(const Plane& found_depth, const Plane& true_depth);
};

struct DepthAgreement {
  double scale = 1;         // true by found, median
  double mean_percent = 0;  // relative difference after this one scale
  double median_percent = 0;
  double spearman = 0;         // rank correlation
  double covered_percent = 0;  // of what was asked
};

// Of at least one pair; throws std::invalid_argument else.
DepthAgreement agreement_of(const DepthPairs& pairs);

// The rank correlation of two sequences of one length; equal values share their mean rank.
double spearman(const std::vector<float>& a, const std::vector<float>& b);

// Between the four pixels round a place; +inf where one of them has no depth or it is outside.
float depth_between(const Plane& depth, const Eigen::Vector2d& pixel);

// Points of a cloud as a camera sees them.
struct SeenPoint {
  Eigen::Vector2d pixel;
  float depth;
};
// Those in the picture, without the ones behind a nearer one in the same square of `cell_px`.
std::vector<SeenPoint> nearest_points(const PosedCamera& camera,
                                      const std::vector<Eigen::Vector3d>& cloud, int cell_px);

}  // namespace organbake
