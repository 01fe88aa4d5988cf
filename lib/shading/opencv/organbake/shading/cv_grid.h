// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <opencv2/core.hpp>

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

}  // namespace organbake
