// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/motion/tracked_picture.h"

#include <opencv2/imgproc.hpp>

#include "organbake/shading/cv_grid.h"

namespace organbake {

Grid<std::uint8_t> tracked_picture(const Rgb8Image& frame) {
  const cv::Mat color(frame.height, frame.width, CV_8UC3,
                      const_cast<std::uint8_t*>(frame.pixels.data()));
  Grid<std::uint8_t> even(frame.width, frame.height);
  cv::Mat green, target = cv_view(even);
  cv::extractChannel(color, green, 1);
  cv::createCLAHE(3.0, cv::Size(8, 8))->apply(green, target);
  return even;
}

}  // namespace organbake
