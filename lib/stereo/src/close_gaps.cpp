// SPDX-License-Identifier: GPL-3.0-or-later
// Gaps are what a disc of their width, moved about in what is unknown, does not reach (the closing
// of what is known: Serra 1982), by two distance transforms. Each pixel's value is of the narrowest
// window that sees enough of the surroundings, so that it is the same however wide gaps may be.
#include "close_gaps.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "organbake/shading/cv_grid.h"
#include "organbake/stereo/local_planes.h"

namespace organbake {
namespace {

// Pixels that no disc of that width fits over without touching a known one.
cv::Mat closed(const Mask& known, double width_px) {
  const double radius = 0.5 * width_px;
  // Nothing is known beyond the picture.
  const int margin = static_cast<int>(radius) + 2;
  cv::Mat unknown, distance;
  cv::copyMakeBorder(cv_view(known) == 0, unknown, margin, margin, margin, margin,
                     cv::BORDER_CONSTANT, 255);
  cv::distanceTransform(unknown, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  const cv::Mat near = distance <= radius;
  cv::distanceTransform(near, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  const cv::Mat result = distance > radius;
  return result(cv::Rect(margin, margin, known.width, known.height)).clone();
}

}  // namespace

Mask close_gaps(const Mask& tissue, double width_px, Disparity& disparity) {
  const int width = tissue.width, height = tissue.height;
  Mask filled(width, height);
  if (width_px < 1) return filled;
  const cv::Mat gaps = closed(disparity.known, width_px);
  Mask open(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      open.at(x, y) = gaps.at<std::uint8_t>(y, x) && tissue.at(x, y) && !disparity.known.at(x, y);
  constexpr float kEnough = 0.25F, kFlat = 0.02F;  // of the window; of the disparity
  Plane known(width, height);
  for (std::size_t k = 0; k < known.size(); ++k) known.values[k] = disparity.known.values[k];
  for (int radius = 4; radius < 2 * std::max(width, height); radius *= 2) {
    if (std::find(open.values.begin(), open.values.end(), 1) == open.values.end()) break;
    const LocalPlanes around(disparity.px, known, radius);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        if (!open.at(x, y) || around.weight(x, y) < kEnough) continue;
        open.at(x, y) = 0;
        const LocalPlanes::Fit fit = around.at(x, y);
        const float most = kFlat * fit.value;
        filled.at(x, y) = fit.variance <= most * most;
        if (filled.at(x, y)) disparity.px.at(x, y) = fit.value;
      }
  }
  return filled;
}

}  // namespace organbake
