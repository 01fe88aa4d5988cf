// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <opencv2/core.hpp>

#include "organbake/shading/grid.h"

namespace organbake {

// A grid as OpenCV sees it; the memory stays the grid's.
inline cv::Mat cv_view(Mask& mask) { return {mask.height, mask.width, CV_8U, mask.values.data()}; }
inline cv::Mat cv_view(Plane& plane) {
  return {plane.height, plane.width, CV_32F, plane.values.data()};
}
// OpenCV has no read-only view: only for what it reads.
template <class T>
cv::Mat cv_view(const Grid<T>& grid) {
  return cv_view(const_cast<Grid<T>&>(grid));
}

}  // namespace organbake
