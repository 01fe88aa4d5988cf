// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "organbake/image/channel_image.h"
#include "organbake/shading/grid.h"

namespace organbake {

// A grid or a picture as OpenCV sees it; the memory stays the grid's.
inline cv::Mat cv_view(Mask& mask) { return {mask.height, mask.width, CV_8U, mask.values.data()}; }
inline cv::Mat cv_view(Plane& plane) {
  return {plane.height, plane.width, CV_32F, plane.values.data()};
}
inline cv::Mat cv_view(Rgb8Image& picture) {
  return {picture.height, picture.width, CV_8UC3, picture.pixels.data()};
}
// OpenCV has no read-only view: only for what it reads.
template <class Grid>
cv::Mat cv_view(const Grid& grid) {
  return cv_view(const_cast<Grid&>(grid));
}

// Means over windows of 4 radius + 1 pixels a side, weighted like a tent: what one box does after
// another of 2 radius + 1. Nothing lies outside the picture.
inline cv::Mat tent_mean(const cv::Mat& values, int radius) {
  const int box = 2 * radius + 1;
  cv::Mat tent(1, 2 * box - 1, CV_32F);
  for (int i = 0; i < tent.cols; ++i)
    tent.at<float>(i) =
        static_cast<float>(box - std::abs(i - 2 * radius)) / static_cast<float>(box * box);
  cv::Mat mean;
  cv::sepFilter2D(values, mean, CV_32F, tent, tent, {-1, -1}, 0, cv::BORDER_CONSTANT);
  return mean;
}

}  // namespace organbake
