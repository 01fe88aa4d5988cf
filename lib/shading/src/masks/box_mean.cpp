// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/grid_filters.h"

#include <opencv2/imgproc.hpp>

#include "organbake/shading/cv_grid.h"

namespace organbake {

Plane box_mean(const Plane& plane, const Mask& inside, int radius) {
  Plane sum(plane.width, plane.height), count(plane.width, plane.height);
  if (plane.size() == 0) return sum;
  for (std::size_t k = 0; k < plane.size(); ++k) {
    count.values[k] = inside.values[k] ? 1.F : 0.F;
    sum.values[k] = inside.values[k] ? plane.values[k] : 0.F;
  }
  const cv::Size window(2 * radius + 1, 2 * radius + 1);
  for (Plane* one : {&sum, &count}) {
    cv::Mat view = cv_view(*one);
    cv::boxFilter(view, view, CV_32F, window, {-1, -1}, /*normalize=*/false, cv::BORDER_CONSTANT);
  }
  for (std::size_t k = 0; k < sum.size(); ++k) {
    sum.values[k] = count.values[k] > 0.5F ? sum.values[k] / count.values[k] : 0;
  }
  return sum;
}

}  // namespace organbake
