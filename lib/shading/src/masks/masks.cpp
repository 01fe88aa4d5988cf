// SPDX-License-Identifier: GPL-3.0-or-later
// Masks of what is not tissue in a frame: the black border and highlights. Each by a property that
// holds for all endoscopes (what is joined to the largest bright region; white against its
// surroundings), since there is no training set for every one of them.
#include "organbake/shading/masks.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "organbake/core/quantile.h"
#include "organbake/shading/cv_grid.h"
#include "organbake/shading/grid_filters.h"

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

constexpr int kBlack = 16;  // of the brightest channel: what coding leaves of a black border

// Means of the brightest channel over a window that is wider than a stop's edge is blurred.
struct SmoothLevels {
  Plane mean, range;  // range: between the least and the greatest mean of such a window
  int radius = 0;
};

SmoothLevels smooth_levels(const Rgb8Image& frame) {
  SmoothLevels levels{Plane(frame.width, frame.height), Plane(frame.width, frame.height),
                      std::max(2, std::max(frame.width, frame.height) / 200)};
  for (std::size_t k = 0; k < levels.mean.size(); ++k)
    levels.mean.values[k] =
        std::max({frame.pixels[3 * k], frame.pixels[3 * k + 1], frame.pixels[3 * k + 2]});
  cv::Mat mean = cv_view(levels.mean), range = cv_view(levels.range);
  const int side = 2 * levels.radius + 1;
  cv::blur(mean, mean, {side, side});
  cv::morphologyEx(mean, range, cv::MORPH_GRADIENT, square(levels.radius));
  return levels;
}

// With the tissue that the lamp or the lens leaves as dark as a black border: it is joined to what
// is inside without the step that a stop makes, and lighter than the darkest that there is.
Mask with_dark_tissue(const Rgb8Image& frame, const Mask& inside) {
  constexpr float kAboveBorder = 2, kGentle = 0.6F;  // levels; of the mean
  const SmoothLevels levels = smooth_levels(frame);
  std::vector<float> outside;
  for (std::size_t k = 0; k < inside.size(); ++k)
    if (!inside.values[k]) outside.push_back(levels.mean.values[k]);
  if (outside.empty()) return inside;
  const auto at = outside.begin() + static_cast<std::ptrdiff_t>(outside.size() / 10);
  std::nth_element(outside.begin(), at, outside.end());
  const float least = *at + kAboveBorder;
  if (least >= kBlack) return inside;
  Mask joined = inside;
  for (std::size_t k = 0; k < joined.size(); ++k)
    if (levels.mean.values[k] > least && levels.range.values[k] < kGentle * levels.mean.values[k])
      joined.values[k] = 1;
  const Mask dark = without(regions_touching(joined, inside), inside);
  const Mask wide = dilated(eroded(dark, levels.radius), levels.radius);  // no fringe of an edge
  for (std::size_t k = 0; k < joined.size(); ++k)
    joined.values[k] = inside.values[k] || (dark.values[k] && wide.values[k]);
  return with_holes_closed(joined);
}

constexpr float kSaturated = 250;
// A mirror reflection adds white light: the least of the three channels rises most against its
// surroundings.
constexpr float kWhiter = 32, kWhiterShare = 0.6F;

// What is as white as tissue lies over more than a highlight's width, or is far from the whitest of
// the picture.
constexpr double kOfTheWhitest = 0.4, kBeyondNoise = 5;

Plane least_channel(const Rgb8Image& frame) {
  Plane least(frame.width, frame.height);
  for (std::size_t k = 0; k < least.size(); ++k)
    least.values[k] =
        std::min({frame.pixels[3 * k], frame.pixels[3 * k + 1], frame.pixels[3 * k + 2]});
  return least;
}

// What rises above all that is wider than a square of 2·radius + 1 pixels (a white top-hat).
Plane above_opening(const Plane& plane, int radius) {
  Plane raised = plane;
  cv::Mat view = cv_view(raised);
  cv::morphologyEx(cv_view(plane), view, cv::MORPH_TOPHAT, square(radius));
  return raised;
}

// But for one pixel in a thousand.
double whitest(const Plane& white, const Mask& inside) {
  std::vector<float> levels;
  for (std::size_t k = 0; k < white.size(); ++k)
    if (inside.values[k]) levels.push_back(white.values[k]);
  return quantile(std::move(levels), 0.999);
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

Mask at_size(const Mask& mask, int width, int height) {
  Mask resized(width, height);
  cv::Mat target = cv_view(resized);
  cv::resize(cv_view(mask), target, target.size(), 0, 0, cv::INTER_NEAREST);
  return resized;
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

Mask field_of_view(const Rgb8Image& frame, int margin_px) {
  Mask lit(frame.width, frame.height);
  std::size_t dark = 0;
  for (int y = 0; y < frame.height; ++y)
    for (int x = 0; x < frame.width; ++x) {
      const std::uint8_t* p = frame.at(x, y);
      lit.at(x, y) = std::max({p[0], p[1], p[2]}) > kBlack;
      dark += !lit.at(x, y);
    }
  if (dark == lit.size() || dark == 0) return lit;
  const Mask inside = with_dark_tissue(frame, with_holes_closed(largest_region(lit)));
  // The frame's own edge is no stop: only the inner border shrinks.
  return eroded(inside, margin_px);
}

Mask find_highlights(const Rgb8Image& frame, const Mask& inside) {
  const Plane white = least_channel(frame);
  const int side = std::max(frame.width, frame.height);
  const Plane raised = above_opening(white, std::max(3, side / 40));
  const double faint = kOfTheWhitest * whitest(white, inside);
  const double noise = kBeyondNoise * noise_level(white, inside);
  const double least_rise = std::max(double(kWhiter), noise);
  // Twice: the first mean is raised by the highlights themselves.
  Mask usual = inside, found(frame.width, frame.height);
  for (int pass = 0; pass < 2; ++pass) {
    const Plane around = box_mean(white, usual, std::max(3, side / 20));
    for (std::size_t k = 0; k < white.size(); ++k) {
      const float level = white.values[k], rise = level - around.values[k];
      const bool bright =
          level >= kSaturated || (level >= faint && std::min(rise, raised.values[k]) > least_rise &&
                                  rise > kWhiterShare * std::max(around.values[k], 20.F));
      found.values[k] = inside.values[k] && bright;
      usual.values[k] = inside.values[k] && !found.values[k];
    }
  }
  return common(dilated(found, std::max(1, side / 400)), inside);
}

}  // namespace organbake
