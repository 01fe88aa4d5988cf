// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/masks.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "organbake/shading/cv_grid.h"

namespace organbake {
namespace {

constexpr int kFourNeighbours = 4;

cv::Mat square(int radius) {
  return cv::getStructuringElement(cv::MORPH_RECT, {2 * radius + 1, 2 * radius + 1});
}

// 0 where `mask` is 0, else the number of the pixel's region; returns how many numbers there are.
int label_regions(const Mask& mask, Grid<std::int32_t>& labels) {
  labels = Grid<std::int32_t>(mask.width, mask.height);
  cv::Mat out(mask.height, mask.width, CV_32S, labels.values.data());
  return cv::connectedComponents(cv_view(mask), out, kFourNeighbours, CV_32S);
}

}  // namespace

Mask dilated(const Mask& mask, int radius) {
  if (radius <= 0 || mask.size() == 0) return mask;
  Mask result(mask.width, mask.height);
  cv::Mat out = cv_view(result);
  cv::dilate(cv_view(mask), out, square(radius));
  return result;
}

Mask eroded(const Mask& mask, int radius) {
  if (radius <= 0 || mask.size() == 0) return mask;
  Mask result(mask.width, mask.height);
  cv::Mat out = cv_view(result);
  cv::erode(cv_view(mask), out, square(radius));
  return result;
}

Mask common(Mask a, const Mask& b) {
  for (std::size_t k = 0; k < a.size(); ++k) a.values[k] = a.values[k] && b.values[k];
  return a;
}

Mask without(Mask a, const Mask& b) {
  for (std::size_t k = 0; k < a.size(); ++k) {
    if (b.values[k]) a.values[k] = 0;
  }
  return a;
}

Mask largest_region(const Mask& mask) {
  Mask region(mask.width, mask.height);
  if (mask.size() == 0) return region;
  Grid<std::int32_t> labels;
  std::vector<std::size_t> sizes(static_cast<std::size_t>(label_regions(mask, labels)));
  for (const std::int32_t label : labels.values) ++sizes[label];
  sizes[0] = 0;  // what is not in the mask
  const auto largest = std::max_element(sizes.begin(), sizes.end());
  if (*largest == 0) return region;
  const auto wanted = static_cast<std::int32_t>(largest - sizes.begin());
  for (std::size_t k = 0; k < region.size(); ++k) region.values[k] = labels.values[k] == wanted;
  return region;
}

Mask regions_touching(const Mask& mask, const Mask& seeds) {
  Mask kept(mask.width, mask.height);
  if (mask.size() == 0) return kept;
  Grid<std::int32_t> labels;
  std::vector<bool> touched(static_cast<std::size_t>(label_regions(mask, labels)), false);
  for (std::size_t k = 0; k < mask.size(); ++k) {
    if (seeds.values[k]) touched[labels.values[k]] = true;
  }
  touched[0] = false;
  for (std::size_t k = 0; k < mask.size(); ++k) kept.values[k] = touched[labels.values[k]];
  return kept;
}

Mask with_holes_closed(const Mask& mask) {
  Mask zeros = mask, edge(mask.width, mask.height);
  for (std::uint8_t& value : zeros.values) value = !value;
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      edge.at(x, y) = x == 0 || y == 0 || x == mask.width - 1 || y == mask.height - 1;
    }
  }
  Mask result = regions_touching(zeros, edge);
  for (std::uint8_t& value : result.values) value = !value;
  return result;
}

}  // namespace organbake
