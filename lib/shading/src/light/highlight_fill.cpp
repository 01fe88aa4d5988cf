// SPDX-License-Identifier: GPL-3.0-or-later
// Highlights and their glow are told from tissue by the dichromatic model (Shafer 1985): what is
// mirrored has the lamp's colour, the rest the tissue's own.
#include "light/highlight_fill.h"

#include <Eigen/Core>
#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "organbake/core/median.h"
#include "organbake/image/srgb.h"
#include "organbake/shading/grid_filters.h"
#include "organbake/shading/masks.h"

namespace organbake {
namespace {

constexpr int kGlowShare = 24;  // of the longer side: how far a highlight's glow reaches

int share_of_side(const PreparedFrame& frame, int share) {
  return std::max(1, std::max(frame.color.width, frame.color.height) / share);
}

Eigen::Vector3f at(const LinearColor& color, std::size_t k) {
  return {color[0].values[k], color[1].values[k], color[2].values[k]};
}

// Pixels of which a camera cut so many channels off. Of two the hue is what was left of it. One
// alone, red, is cut off on much of what is pale, and a vessel there is still a vessel.
Mask clipped(const Rgb8Image& frame, int channels) {
  constexpr int kClipped = 245;
  Mask mask(frame.width, frame.height);
  for (std::size_t k = 0; k < mask.size(); ++k) {
    const std::uint8_t* level = &frame.pixels[3 * k];
    mask.values[k] =
        (level[0] >= kClipped) + (level[1] >= kClipped) + (level[2] >= kClipped) >= channels;
  }
  return mask;
}

// 1, or less where something dark, such as a vessel, shows through a broad sheen: brightness by the
// median round it. Among sparks, where the median is no sheen's, what is dark is a lens's or a
// codec's ring.
Plane dark_detail(const Rgb8Image& frame, int radius_px) {
  constexpr float kLeast = 0.6F, kNoSheen = 140, kSheen = 200;  // levels of 255
  constexpr int kWidest_px = 127;                               // half, of OpenCV's median of bytes
  Plane detail(frame.width, frame.height, 1);
  cv::Mat green(frame.height, frame.width, CV_8UC1), usual;
  for (std::size_t k = 0; k < detail.size(); ++k)
    green.data[k] = frame.pixels[3 * k + 1];  // in which blood is dark
  cv::medianBlur(green, usual, 2 * std::min(radius_px, kWidest_px) + 1);
  for (std::size_t k = 0; k < detail.size(); ++k) {
    const float around = linear_from_srgb8()[usual.data[k]];
    const float own = linear_from_srgb8()[green.data[k]];
    const float sheen =
        std::clamp((float(usual.data[k]) - kNoSheen) / (kSheen - kNoSheen), 0.F, 1.F);
    if (sheen > 0) detail.values[k] = 1 - sheen * (1 - std::clamp(own / around, kLeast, 1.F));
  }
  return detail;
}

// Colours as shares of their sum, filled from where `clear` says they are known and bright enough
// to be more than noise.
LinearColor chromaticity_around(const LinearColor& color, const Mask& clear, int smoothing_px) {
  const Mask everywhere(clear.width, clear.height, 1);
  LinearColor shares;
  Plane sum(clear.width, clear.height);
  for (int c = 0; c < 3; ++c) {
    shares[c] = box_mean(color[c], clear, smoothing_px);
    for (std::size_t k = 0; k < sum.size(); ++k) sum.values[k] += shares[c].values[k];
  }
  constexpr float kDark = 0.05F;  // of the median
  std::vector<float> sums;
  for (std::size_t k = 0; k < sum.size(); ++k)
    if (clear.values[k]) sums.push_back(sum.values[k]);
  const float least = kDark * median(std::move(sums));
  Mask known = clear;
  for (std::size_t k = 0; k < sum.size(); ++k)
    known.values[k] = clear.values[k] && sum.values[k] > least;
  for (Plane& plane : shares) {
    for (std::size_t k = 0; k < sum.size(); ++k)
      if (known.values[k]) plane.values[k] /= sum.values[k];
    fill_outside(plane, known);
  }
  return shares;
}

// Round a highlight lies its glow, and tissue that mirrors a little. What is mirrored is white, and
// adds to the tissue's colour: with the colour of the tissue around, least squares over the three
// channels tell the two apart, and the texture stays.
void take_glow_out(const PreparedFrame& frame, const Mask& clear, const Mask& near,
                   LinearColor& color) {
  constexpr int kAroundShare = 40;  // of the longer side
  constexpr float kNoise = 0.05F;   // of the tissue's luminance: less white is no glow
  constexpr float kLeast = 0.75F;   // of the colour around: pale tissue is white by itself
  const int reach = share_of_side(frame, kGlowShare);
  const Mask free = without(clear, near);
  const Mask everywhere(clear.width, clear.height, 1);
  LinearColor around = color;
  for (Plane& plane : around) {
    fill_outside(plane, free);
    plane = box_mean(plane, everywhere, share_of_side(frame, kAroundShare));
  }
  // 1 beside the highlight, falling to 0 where its glow ends: no border of it may show.
  Plane fading(near.width, near.height);
  for (std::size_t k = 0; k < near.size(); ++k) fading.values[k] = near.values[k];
  fading = box_mean(box_mean(fading, everywhere, reach / 2), everywhere, reach / 4);
  for (std::size_t k = 0; k < clear.size(); ++k) {
    if (!clear.values[k] || !near.values[k]) continue;
    const Eigen::Vector3f tissue = at(around, k), seen = at(color, k);
    const float own = tissue.sum() / 3;
    const Eigen::Vector3f tint = tissue - Eigen::Vector3f::Constant(own);
    if (tint.squaredNorm() < 1e-4F * own * own) continue;  // grey tissue: white tells nothing
    const float amount = tint.dot(seen) / tint.squaredNorm();
    const float white = std::min(seen.sum() / 3 - std::max(0.F, amount) * own,
                                 std::max(0.F, (seen - kLeast * tissue).minCoeff()));
    const float over = std::clamp(white / (kNoise * own) - 1, 0.F, 1.F) *
                       std::clamp(2 * fading.values[k] - 1, 0.F, 1.F);
    for (Plane& plane : color) plane.values[k] = std::max(0.F, plane.values[k] - over * white);
  }
}

}  // namespace

Mask clear_tissue(const PreparedFrame& frame) {
  constexpr int kRimShare = 200;  // of the longer side
  Mask unclear = dilated(frame.highlights, std::max(1, share_of_side(frame, kRimShare)));
  const Mask cut_off = dilated(clipped(frame.color, 2), 1);
  for (std::size_t k = 0; k < unclear.size(); ++k) unclear.values[k] |= cut_off.values[k];
  const Mask clear = without(frame.diffuse, unclear);
  const bool any = std::any_of(clear.values.begin(), clear.values.end(),
                               [](std::uint8_t value) { return value != 0; });
  return any ? clear : frame.diffuse;
}

void take_highlights_out(const PreparedFrame& frame, const Mask& clear, LinearColor& color) {
  constexpr int kHueShare = 160;    // of the longer side: hues are read over as many pixels
  constexpr int kDetailShare = 60;  // and what is dark is wider than no vessel
  const Mask near = dilated(frame.highlights, share_of_side(frame, kGlowShare));
  take_glow_out(frame, clear, near, color);
  const Mask cut_off = clipped(frame.color, 1);
  const LinearColor shares =
      chromaticity_around(color, without(clear, cut_off), share_of_side(frame, kHueShare));
  Plane sum = color[0];
  for (std::size_t k = 0; k < sum.size(); ++k) sum.values[k] = at(color, k).sum();
  fill_outside(sum, clear);
  const Plane detail = dark_detail(frame.color, share_of_side(frame, kDetailShare));
  for (std::size_t k = 0; k < sum.size(); ++k) {
    // White taken from what is cut off leaves another hue.
    const bool keeps_its_light = clear.values[k] != 0;
    if (keeps_its_light && !(cut_off.values[k] && near.values[k])) continue;
    const float all = std::max(1e-6F, at(shares, k).sum());
    const float bright = sum.values[k] * (keeps_its_light ? 1 : detail.values[k]);
    for (int c = 0; c < 3; ++c) color[c].values[k] = bright * shares[c].values[k] / all;
  }
}

}  // namespace organbake
