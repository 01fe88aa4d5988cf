// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/image/channel_image.h"
#include "support/testing.h"

namespace organbake {

// Part of a picture that shows one tissue.
struct TissuePicture {
  Rgb8Image image;
  std::vector<std::uint8_t> mask;  // of the image's size: 1 where that tissue is
  double mm_per_pixel = 0.15;
};

// How a tissue looks, as numbers that do not depend on where anything lies in the picture. All are
// of the picture brought to kGrain_mm a pixel.
struct TissueAppearance {
  static constexpr double kGrain_mm = 0.3;
  static constexpr int kQuantiles = 9, kOctaves = 4;

  // CIE Lab by quantiles of 10…90 %, highlights left out; L less its median, since exposure is the
  // camera's.
  std::array<std::array<double, kQuantiles>, 3> lab{};
  double gradient_mean = 0, gradient_p95 = 0;  // of L, a mm
  // Highlights: share of the tissue, log₂ of the count in 10 cm² and of the median size in mm², and
  // the mean of their long axes over their short ones.
  double highlight_share = 0, highlight_count = 0, highlight_size = 0, highlight_elongation = 1;
  // All of their areas, ascending; the largest one's share of all; and how far they lie from the
  // middle of their group, root mean square by area: a group shows one place that faces the lamp.
  std::vector<double> highlight_mm2;
  double largest_highlight = 0, highlight_spread_mm = 0;
  // Of L between Gaussians an octave apart, from one pixel on: log₂ of the energy, and kurtosis.
  std::array<double, kOctaves> energy{}, kurtosis{};
  double correlation_mm = 0;  // where the autocorrelation of L falls to 1/e
};

// Throws BadDataError for less than a thousand pixels of tissue.
TissueAppearance appearance_of(const TissuePicture& picture);

// One number of the distance, and how it is meant.
struct TissueAppearancePart {
  std::string name;
  double distance = 0;
};
// Differences of two appearances, part by part.
std::vector<TissueAppearancePart> appearance_parts(const TissueAppearance& a,
                                                   const TissueAppearance& b);

// Each part's mean over pairs of one of these and one of those; of one list with itself over its
// pairs of two.
std::vector<TissueAppearancePart> mean_parts(const std::vector<TissueAppearance>& these,
                                             const std::vector<TissueAppearance>& those);

// Every part in units of what two real pictures differ by, at most five of them, so that none
// speaks for all. Their mean is the distance.
std::vector<TissueAppearancePart> in_real_differences(
    const std::vector<TissueAppearancePart>& parts, const std::vector<TissueAppearancePart>& real);
double mean_distance(const std::vector<TissueAppearancePart>& parts);

// A part of a picture, within it.
TissuePicture piece_of(const TissuePicture& picture, int x0, int y0, int width, int height);

// Where a frame shows bright tissue (gallbladder, fat) within a box of pixels: of at least that
// lightness and yellowness in CIE Lab.
struct BrightTissue {
  int x0, y0, x1, y1;
  double least_l, least_b;
};
std::vector<std::uint8_t> bright_mask(const Rgb8Image& frame, const BrightTissue& tissue);

// Where a frame of a laparoscopy shows liver: dark red of middle saturation, with the highlights
// that lie in it, in pieces of at least two per cent of the frame.
std::vector<std::uint8_t> liver_mask(const Rgb8Image& frame);

}  // namespace organbake
