// SPDX-License-Identifier: GPL-3.0-or-later
// The detail of a frame for colours that were found at a part of its size: each pixel's share of
// what lies round it (a ratio image; Liu, Shan & Zhang 2001), in sRGB's encoding, where noise is
// about the same everywhere. It is added no louder than the frame itself has it: where a gain has
// turned the light up, noise is not turned up with it.
#include "organbake/shading/own_pixels.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "organbake/core/error.h"
#include "organbake/shading/cv_grid.h"

namespace organbake {
namespace {

// Pixels of means over blocks, as the frame's size has them; an odd last row or column, which fell
// away, is the one before it.
cv::Mat at_frame_size(const cv::Mat& reduced, cv::Size size, int halvings, int interpolation) {
  const cv::Size whole = reduced.size() * (1 << halvings);
  cv::Mat fine;
  cv::resize(reduced, fine, whole, 0, 0, interpolation);
  cv::copyMakeBorder(fine, fine, 0, std::max(0, size.height - whole.height), 0,
                     std::max(0, size.width - whole.width), cv::BORDER_REPLICATE);
  return fine(cv::Rect({0, 0}, size));
}

cv::Mat as_float(const Rgb8Image& picture) {
  cv::Mat values;
  cv_view(picture).convertTo(values, CV_32FC3);
  return values;
}

}  // namespace

Rgb8Image with_own_pixels(const Rgb8Image& color, const PreparedFrame& reduced,
                          const Rgb8Image& frame, int halvings) {
  if (color.width != reduced.color.width || color.height != reduced.color.height)
    throw BadDataError("the colours and the reduced frame are of different sizes");
  constexpr float kDark = 12, kLeast = 0.6F, kMost = 1.6F;  // of 255; of a pixel's surroundings
  const cv::Size size(frame.width, frame.height);
  const cv::Mat base = at_frame_size(as_float(color), size, halvings, cv::INTER_LINEAR);
  const cv::Mat around = at_frame_size(as_float(reduced.color), size, halvings, cv::INTER_LINEAR);
  cv::Mat weight;
  cv_view(reduced.diffuse).convertTo(weight, CV_32F);
  cv::min(weight, 1, weight);
  weight = at_frame_size(weight, size, halvings, cv::INTER_LINEAR);
  Rgb8Image fine(frame.width, frame.height);
  for (int y = 0; y < frame.height; ++y)
    for (int x = 0; x < frame.width; ++x)
      for (int c = 0; c < 3; ++c) {
        const float found = base.at<cv::Vec3f>(y, x)[c], seen = around.at<cv::Vec3f>(y, x)[c];
        const float detail =
            std::clamp((frame.at(x, y)[c] + kDark) / (seen + kDark), kLeast, kMost) - 1;
        const float loudness = std::min(1.F, (seen + kDark) / (found + kDark));
        const float value = found * (1 + weight.at<float>(y, x) * loudness * detail);
        fine.at(x, y)[c] = cv::saturate_cast<std::uint8_t>(value);
      }
  return fine;
}

}  // namespace organbake
