// SPDX-License-Identifier: GPL-3.0-or-later
// The way of a frame from a file's pixels to linear brightness of one albedo, with its masks. Two
// pictures in one frame (stereo endoscopes record so) are told by how alike its halves are.
#include "organbake/shading/prepared_frame.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "light/log_albedo_of_color.h"
#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/geometry/camera.h"
#include "organbake/image/srgb.h"
#include "organbake/shading/cv_grid.h"
#include "organbake/shading/frame_preparation.h"
#include "organbake/shading/grid_filters.h"
#include "organbake/shading/masks.h"
#include "organbake/shading/undistort.h"

namespace organbake {
namespace {

// Means of 2×2 in linear light.
Plane half_size(const Plane& plane) {
  Plane half(std::max(1, plane.width / 2), std::max(1, plane.height / 2));
  for (int y = 0; y < half.height; ++y)
    for (int x = 0; x < half.width; ++x) {
      const int x1 = std::min(2 * x + 1, plane.width - 1);
      const int y1 = std::min(2 * y + 1, plane.height - 1);
      const int x0 = std::min(2 * x, x1), y0 = std::min(2 * y, y1);
      half.at(x, y) =
          0.25F * ((plane.at(x0, y0) + plane.at(x1, y0)) + (plane.at(x0, y1) + plane.at(x1, y1)));
    }
  return half;
}

// Blood takes the blue and leaves the red to saturate first: the mean of red and green carries the
// shading.
Plane linear_intensity(const StoredPicture& frame) {
  Plane intensity(frame.color.width, frame.color.height);
  const auto& linear = linear_from_srgb8();
  const std::vector<std::uint8_t>& levels = frame.color.pixels;
  for (std::size_t k = 0; k < intensity.size(); ++k)
    intensity.values[k] = frame.linear.empty()
                              ? 0.5F * (linear[levels[3 * k]] + linear[levels[3 * k + 1]])
                              : 0.5F * (frame.linear[3 * k] + frame.linear[3 * k + 1]);
  return intensity;
}

Mask reduced(Mask mask, int halvings) {
  for (int i = 0; i < halvings; ++i) {
    Mask half(std::max(1, mask.width / 2), std::max(1, mask.height / 2));
    for (int y = 0; y < half.height; ++y)
      for (int x = 0; x < half.width; ++x)
        half.at(x, y) = mask.at(std::min(2 * x, mask.width - 1), std::min(2 * y, mask.height - 1));
    mask = std::move(half);
  }
  return mask;
}

// A given mask as the reduced frame, without distortion, has it.
std::optional<Mask> mask_of(const Mask* given, const char* what, const StoredPicture& picture,
                            int halvings, const Intrinsics& lens, const Intrinsics& pinhole) {
  if (!given) return std::nullopt;
  const Rgb8Image& frame = picture.color;
  if (given->width != frame.width || given->height != frame.height)
    throw BadDataError("the frame is " + std::to_string(frame.width) + "x" +
                       std::to_string(frame.height) + ", the mask of " + what + " " +
                       std::to_string(given->width) + "x" + std::to_string(given->height) +
                       "; it must have the frame's size");
  Mask mask = reduced(*given, halvings);
  return lens.has_distortion() ? undistorted(mask, lens, pinhole) : mask;
}

void find_masks(std::optional<Mask> given_instruments, const std::optional<Mask>& insets,
                bool wanted, PreparedFrame& frame) {
  const int width = frame.color.width, height = frame.color.height;
  frame.field = Mask(width, height, 1);
  frame.highlights = frame.instruments = Mask(width, height);
  if (wanted) frame.field = field_of_view(frame.color, std::max(1, width / 150));
  if (insets) frame.field = without(std::move(frame.field), *insets);
  if (wanted) {
    if (given_instruments) {
      frame.colourless = is_colourless(frame.color, frame.field);
    } else {
      std::optional<Mask> found = find_instruments(frame.color, frame.field);
      frame.colourless = !found;
      if (found) frame.instruments = std::move(*found);
    }
  }
  if (given_instruments) frame.instruments = std::move(*given_instruments);
  frame.tissue = without(frame.field, frame.instruments);
  if (wanted) frame.highlights = find_highlights(frame.color, frame.tissue);
  frame.diffuse = without(frame.tissue, frame.highlights);
}

constexpr int kHalfSide = 96;  // of a half, at most: enough to know a scene again
// Chosen, not measured: real frames of one eye and of two are still to be held against it.
constexpr double kAlike = 0.7;
constexpr double kMostDisparity = 0.15;  // of the half's size: the largest disparity
constexpr int kRowsAskew = 2;            // eyes may stand a little askew

Plane reduced_half(const Rgb8Image& frame, int left, int top, int width, int height) {
  const int step = std::max(1, (std::max(width, height) + kHalfSide - 1) / kHalfSide);
  Plane half(width / step, height / step);
  for (int y = 0; y < half.height; ++y)
    for (int x = 0; x < half.width; ++x) {
      int sum = 0;
      for (int j = 0; j < step; ++j)
        for (int i = 0; i < step; ++i) sum += frame.at(left + x * step + i, top + y * step + j)[1];
      half.at(x, y) = static_cast<float>(sum) / static_cast<float>(step * step);
    }
  // Slow shading is alike in many pictures.
  const Mask all(half.width, half.height, 1);
  const Plane slow = box_mean(half, all, std::max(1, std::min(half.width, half.height) / 6));
  for (std::size_t k = 0; k < half.size(); ++k) half.values[k] -= slow.values[k];
  return half;
}

double correlation(const Plane& a, const Plane& b, int shift_x, int shift_y) {
  double aa = 0, bb = 0, ab = 0;
  for (int y = std::max(0, -shift_y); y < a.height - std::max(0, shift_y); ++y)
    for (int x = std::max(0, -shift_x); x < a.width - std::max(0, shift_x); ++x) {
      const double p = a.at(x, y), q = b.at(x + shift_x, y + shift_y);
      aa += p * p;
      bb += q * q;
      ab += p * q;
    }
  return aa > 0 && bb > 0 ? ab / std::sqrt(aa * bb) : 0;
}

bool alike(const Plane& a, const Plane& b) {
  const int reach = static_cast<int>(kMostDisparity * a.width);
  double best = 0;
  for (int dy = -kRowsAskew; dy <= kRowsAskew; ++dy)
    for (int dx = -reach; dx <= reach; ++dx) best = std::max(best, correlation(a, b, dx, dy));
  return best >= kAlike;
}

}  // namespace

void FrameOptions::check() const {
  if (!(halvings >= 0 && halvings <= 4))
    throw UsageError("halvings is " + std::to_string(halvings) + "; it must be in 0…4");
}

Rgb8Image half_size(const Rgb8Image& frame) {
  Rgb8Image half(std::max(1, frame.width / 2), std::max(1, frame.height / 2));
  cv::Mat target = cv_view(half);
  const cv::Rect even(0, 0, std::min(2 * half.width, frame.width),
                      std::min(2 * half.height, frame.height));
  cv::resize(cv_view(frame)(even), target, target.size(), 0, 0, cv::INTER_AREA);
  return half;
}

Intrinsics half_size(Intrinsics camera) {
  camera.width = std::max(1, camera.width / 2);
  camera.height = std::max(1, camera.height / 2);
  camera.fx /= 2;
  camera.fy /= 2;
  camera.cx /= 2;
  camera.cy /= 2;
  return camera;
}

Intrinsics assumed_camera(int width, int height, double field_of_view_rad) {
  if (!(field_of_view_rad >= kNarrowestView_rad && field_of_view_rad <= kWidestView_rad))
    throw UsageError("the field of view is " + to_text(field_of_view_rad) + " rad; it must be in " +
                     to_text(kNarrowestView_rad) + "…" + to_text(kWidestView_rad) +
                     " (70 degrees are 1.22 rad)");
  Intrinsics camera;
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = 0.5 * width / std::tan(0.5 * field_of_view_rad);
  camera.cx = 0.5 * width;
  camera.cy = 0.5 * height;
  return camera;
}

PreparedFrame prepare_frame(const StoredPicture& picture, const Intrinsics& camera,
                            const FrameOptions& options, const GivenMasks& given) {
  options.check();
  camera.check();
  const Rgb8Image& frame = picture.color;
  if (frame.width != camera.width || frame.height != camera.height)
    throw BadDataError("the frame is " + std::to_string(frame.width) + "x" +
                       std::to_string(frame.height) + ", its camera " +
                       std::to_string(camera.width) + "x" + std::to_string(camera.height));
  PreparedFrame ready;
  StoredPicture upper = picture;
  ready.was_combed = is_combed(frame);
  if (ready.was_combed) deinterlace(upper);
  ready.intensity = linear_intensity(upper);
  ready.color = std::move(upper.color);
  ready.stereo = find_stereo_layout(ready.color);
  Intrinsics lens = camera;
  for (int i = 0; i < options.halvings; ++i) {
    ready.color = half_size(ready.color);
    ready.intensity = half_size(ready.intensity);
    lens = half_size(lens);
  }
  ready.camera = pinhole_of(lens);
  const auto known = [&](const Mask* mask, const char* what) {
    return mask_of(mask, what, picture, options.halvings, lens, ready.camera);
  };
  std::optional<Mask> instruments = known(given.instruments, "instruments");
  const std::optional<Mask> insets = known(given.insets, "insets");
  if (lens.has_distortion()) {
    ready.color = undistorted(ready.color, lens, ready.camera);
    ready.intensity = undistorted(ready.intensity, lens, ready.camera);
  }
  find_masks(std::move(instruments), insets, options.masks, ready);
  if (options.piecewise_albedo) {
    ready.log_albedo = log_albedo_of_color(ready.color, ready.intensity, ready.diffuse);
    for (std::size_t k = 0; k < ready.intensity.size(); ++k)
      ready.intensity.values[k] *= std::exp(-ready.log_albedo.values[k]);
  }
  return ready;
}

StereoLayout find_stereo_layout(const Rgb8Image& frame) {
  constexpr int kSmallest = 32;
  const int width = frame.width, height = frame.height;
  if (width < kSmallest || height < kSmallest) return StereoLayout::none;
  if (alike(reduced_half(frame, 0, 0, width / 2, height),
            reduced_half(frame, width - width / 2, 0, width / 2, height)))
    return StereoLayout::side_by_side;
  if (alike(reduced_half(frame, 0, 0, width, height / 2),
            reduced_half(frame, 0, height - height / 2, width, height / 2)))
    return StereoLayout::top_bottom;
  return StereoLayout::none;
}

}  // namespace organbake
