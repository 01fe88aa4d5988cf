// SPDX-License-Identifier: GPL-3.0-or-later
// The way of a frame from a file's pixels to linear brightness of one albedo, with its masks. Two
// pictures in one frame (stereo endoscopes record so) are told by how alike its halves are.
#include "organbake/shading/prepared_frame.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "organbake/image/srgb.h"
#include "organbake/shading/cv_grid.h"
#include "organbake/shading/grid_filters.h"
#include "organbake/shading/masks.h"

namespace organbake {
namespace {

// Albedo from colour alone: shading changes brightness and leaves chromaticity, so that steps of
// brightness that go with steps of chromaticity are steps of albedo. Least absolute deviations,
// because many of the steps are shading and must not pull.

// Below this share of the mean brightness a colour is mostly noise, and is drawn to the mean.
constexpr float kDark = 0.1F;

// Chromaticities that differ less than this are one tissue: their pairs count little.
constexpr double kSameColour = 0.02;

constexpr double kMostLog = 1.5;  // tissues differ by a factor of 4.5 at most

// Red and green shares of the smoothed linear colour, less their means.
struct Chromaticity {
  Plane red, green;
  Eigen::Vector2d at(std::size_t k) const { return {red.values[k], green.values[k]}; }
};

Chromaticity chromaticity_of(const Rgb8Image& frame, const Mask& inside) {
  Plane linear[3];
  double mean[3] = {}, count = 0;
  for (int c = 0; c < 3; ++c) {
    Plane plane(frame.width, frame.height);
    for (std::size_t k = 0; k < plane.size(); ++k)
      plane.values[k] = linear_from_srgb8()[frame.pixels[3 * k + c]];
    linear[c] = box_mean(plane, inside, std::max(1, frame.width / 160));
  }
  for (std::size_t k = 0; k < inside.size(); ++k) {
    if (!inside.values[k]) continue;
    for (int c = 0; c < 3; ++c) mean[c] += linear[c].values[k];
    ++count;
  }
  const double all = mean[0] + mean[1] + mean[2];
  Chromaticity colour{Plane(frame.width, frame.height), Plane(frame.width, frame.height)};
  if (!(all > 0)) return colour;
  const float red = static_cast<float>(mean[0] / all), green = static_cast<float>(mean[1] / all);
  const float dark = kDark * static_cast<float>(all / count);
  for (std::size_t k = 0; k < colour.red.size(); ++k) {
    const float sum = linear[0].values[k] + linear[1].values[k] + linear[2].values[k];
    const float counts = sum * sum / (sum * sum + dark * dark) / std::max(sum, 1e-6F);
    colour.red.values[k] = counts * (linear[0].values[k] - red * sum);
    colour.green.values[k] = counts * (linear[1].values[k] - green * sum);
  }
  return colour;
}

struct Step {
  Eigen::Vector2d colour;
  double brightness;  // difference of ln intensity
  double weight;
};

std::vector<Step> steps_between(const Chromaticity& colour, const Plane& intensity,
                                const Mask& inside) {
  const int reach = std::max(2, intensity.width / 80);
  const Plane smooth = box_mean(intensity, inside, std::max(1, intensity.width / 160));
  std::vector<Step> steps;
  const auto compare = [&](int x0, int y0, int x1, int y1) {
    if (x1 >= intensity.width || y1 >= intensity.height) return;
    if (!inside.at(x0, y0) || !inside.at(x1, y1)) return;
    const float one = smooth.at(x0, y0), other = smooth.at(x1, y1);
    if (one <= 0 || other <= 0) return;
    const Eigen::Vector2d step = colour.at(smooth.index(x1, y1)) - colour.at(smooth.index(x0, y0));
    const double size2 = step.squaredNorm();
    steps.push_back(
        {step, std::log(double(other) / one), size2 / (size2 + kSameColour * kSameColour)});
  };
  for (int y = 0; y < intensity.height; y += 2)
    for (int x = 0; x < intensity.width; x += 2) {
      compare(x, y, x + reach, y);
      compare(x, y, x, y + reach);
    }
  return steps;
}

// Least absolute deviations by reweighting, drawn to zero where there is little colour.
Eigen::Vector2d slopes_of(const std::vector<Step>& steps) {
  constexpr int kPasses = 20;
  constexpr double kSmallest = 0.02;  // deviations below this count as squares
  constexpr double kPrior = 1e-5;     // per pair: a tenth of kSameColour²
  Eigen::Vector2d slopes = Eigen::Vector2d::Zero();
  for (int pass = 0; pass < kPasses; ++pass) {
    Eigen::Matrix2d normal =
        Eigen::Matrix2d::Identity() * (kPrior * static_cast<double>(steps.size()) + 1e-12);
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    for (const Step& step : steps) {
      const double off = step.brightness - step.colour.dot(slopes);
      const double weight = step.weight / std::sqrt(off * off + kSmallest * kSmallest);
      normal += weight * step.colour * step.colour.transpose();
      right += weight * step.brightness * step.colour;
    }
    slopes = normal.ldlt().solve(right);
  }
  return slopes;
}

// ln albedo of every pixel, of mean 0 over the inside, as far as colour tells it: tissue of another
// colour (gallbladder against liver, fat, blood) is brighter or darker. Shading is continuous where
// colours meet, so that steps of brightness that go with steps of chromaticity are steps of albedo:
// ln albedo is taken for linear in chromaticity, its two slopes by least absolute deviations over
// pairs of pixels a short way apart. Nothing is decided, so that a slightly other picture gives a
// slightly other albedo.
Plane log_albedo_of_color(const Rgb8Image& frame, const Plane& intensity, const Mask& inside) {
  const Chromaticity colour = chromaticity_of(frame, inside);
  const Eigen::Vector2d slopes = slopes_of(steps_between(colour, intensity, inside));
  Plane log_albedo(frame.width, frame.height);
  for (std::size_t k = 0; k < log_albedo.size(); ++k)
    log_albedo.values[k] =
        static_cast<float>(kMostLog * std::tanh(slopes.dot(colour.at(k)) / kMostLog));
  return log_albedo;
}

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
