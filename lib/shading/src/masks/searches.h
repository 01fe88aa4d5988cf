// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "organbake/image/channel_image.h"
#include "organbake/shading/grid.h"

namespace organbake {

// A reduced picture as the search for shafts sees it. Everything is of one size, in float but for
// `inside`.
struct ShaftView {
  cv::Mat hue;     // 1 = the picture's usual tissue, 0 = as grey as the lamp's light
  cv::Mat known;   // 1 where it is lit enough to tell a hue, else 0
  cv::Mat level;   // logarithm of the brightness
  cv::Mat inside;  // 8 bits: the field of view

  bool holds(double x, double y) const {
    return x >= 0 && y >= 0 && x < inside.cols && y < inside.rows &&
           inside.at<std::uint8_t>(static_cast<int>(y), static_cast<int>(x)) != 0;
  }
};

// A straight strip of the picture between two borders that are nearly parallel. In axes of its own:
// `along` the strip, counted from `origin`, and `across` it.
struct Shaft {
  cv::Point2d origin, along;
  double border[2][2] = {};  // of each side: offset across, and its slope
  double from = 0, to = 0;   // along; the end at the rim and the tip, in either order

  cv::Point2d across() const { return {-along.y, along.x}; }
  cv::Point2d at(double t, double offset) const { return origin + t * along + offset * across(); }
  double edge(int side, double t) const { return border[side][0] + border[side][1] * t; }
  double width(double t) const { return edge(1, t) - edge(0, t); }
};

// Means over a stretch across a strip.
struct StripMean {
  double sum = 0, known = 0, count = 0;

  void add(const ShaftView& view, const cv::Mat& values, cv::Point2d p) {
    if (!view.holds(p.x, p.y)) return;
    const int x = static_cast<int>(p.x), y = static_cast<int>(p.y);
    const float weight = view.known.at<float>(y, x);
    ++count;
    known += weight;
    sum += weight * values.at<float>(y, x);
  }
  bool tells() const { return count > 0 && known >= 0.5 * count; }
  double mean() const { return sum / known; }
};

// The shafts in a picture: strips with two straight, sharp borders that come in from the rim of the
// field of view, whose inside has less of the tissue's hue than both sides, and whose brightness
// runs along them.
std::vector<Shaft> find_shafts(const ShaftView& view);

// A rectangle of pixels; ends are one beyond.
struct Box {
  int left = 0, top = 0, right = 0, bottom = 0;
  double area() const { return double(right - left) * (bottom - top); }
};

// Rectangles whose sides are seams in most of these frames of a clip (of one size), or the frame's
// own border, or outside of the field of view; without what may be the scope's own picture. At most
// four, the surest first; they lie apart or within each other.
std::vector<Box> boxes_of_seams(const std::vector<Rgb8Image>& frames, const Mask& field);

}  // namespace organbake
