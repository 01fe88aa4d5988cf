// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "organbake/shading/grid.h"

namespace organbake {

// The pyramid of a tracked picture, as Lucas–Kanade reads it.
class FlowPyramid {
 public:
  FlowPyramid() = default;
  explicit FlowPyramid(const Grid<std::uint8_t>& picture);
  const std::vector<cv::Mat>& levels() const { return levels_; }

 private:
  std::vector<cv::Mat> levels_;
};

// Where points (pixels, the first one's centre at (0.5, 0.5)) of one picture are in another, by
// pyramidal Lucas–Kanade (Bouguet 2000); nothing for those that, tracked back, end more than
// `most_apart_px` from where they began. `guesses`: where they are about, one each; or empty.
std::vector<std::optional<Eigen::Vector2f>> follow_points(
    const FlowPyramid& from, const FlowPyramid& to, const std::vector<Eigen::Vector2f>& points,
    const std::vector<Eigen::Vector2f>& guesses, double most_apart_px);

// Whether the pixel that holds this point is there and not zero.
bool is_usable(const Mask& usable, const Eigen::Vector2f& point);

}  // namespace organbake
