// SPDX-License-Identifier: Apache-2.0
// How far two pictures are apart: mean, largest difference and PSNR of their values, and the mean
// structural similarity of their luma (Wang et al. 2004).
#include "organbake/image/difference.h"

#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "organbake/core/error.h"

namespace organbake {
namespace {

void check_sizes(const Rgb8Image& a, const Rgb8Image& b, const std::vector<std::uint8_t>& mask) {
  if (a.width != b.width || a.height != b.height)
    throw BadDataError("images of " + std::to_string(a.width) + " × " + std::to_string(a.height) +
                       " and " + std::to_string(b.width) + " × " + std::to_string(b.height) +
                       " pixels cannot be compared");
  if (!mask.empty() && mask.size() != std::size_t(a.width) * a.height)
    throw BadDataError("the mask has " + std::to_string(mask.size()) + " pixels");
}

using Plane = std::vector<double>;

Plane luma(const Rgb8Image& image) {  // Rec. 601 weights, as SSIM's authors use
  Plane plane(std::size_t(image.width) * image.height);
  for (std::size_t i = 0; i < plane.size(); ++i)
    plane[i] = 0.299 * image.pixels[3 * i] + 0.587 * image.pixels[3 * i + 1] +
               0.114 * image.pixels[3 * i + 2];
  return plane;
}

constexpr int kRadius = 5;

std::array<double, 2 * kRadius + 1> gaussian_window() {
  constexpr double kSigma = 1.5;
  std::array<double, 2 * kRadius + 1> window{};
  double sum = 0;
  for (int i = -kRadius; i <= kRadius; ++i)
    sum += window[i + kRadius] = std::exp(-i * i / (2 * kSigma * kSigma));
  for (double& w : window) w /= sum;
  return window;
}

// Separable blur; the window is clipped and renormalised at the border.
Plane blurred(const Plane& plane, int width, int height) {
  static const auto window = gaussian_window();
  const auto pass = [&](const Plane& in, int count, int step, int lines, int line_step) {
    Plane out(in.size());
    for (int line = 0; line < lines; ++line) {
      for (int i = 0; i < count; ++i) {
        double sum = 0, weight = 0;
        for (int k = -kRadius; k <= kRadius; ++k) {
          if (i + k < 0 || i + k >= count) continue;
          sum +=
              window[k + kRadius] * in[std::size_t(line) * line_step + std::size_t(i + k) * step];
          weight += window[k + kRadius];
        }
        out[std::size_t(line) * line_step + std::size_t(i) * step] = sum / weight;
      }
    }
    return out;
  };
  return pass(pass(plane, width, 1, height, width), height, width, width, 1);
}

Plane product(const Plane& a, const Plane& b) {
  Plane out(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) out[i] = a[i] * b[i];
  return out;
}

}  // namespace

ImageDifference compare_images(const Rgb8Image& a, const Rgb8Image& b,
                               const std::vector<std::uint8_t>& mask) {
  check_sizes(a, b, mask);
  ImageDifference result;
  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    if (!mask.empty() && mask[i / 3] == 0) continue;
    const double d = std::abs(double(a.pixels[i]) - b.pixels[i]);
    sum += d;
    squares += d * d;
    result.max_abs = std::max(result.max_abs, d);
    result.pixels += i % 3 == 0;
  }
  const double values = 3.0 * static_cast<double>(result.pixels);
  if (result.pixels > 0) result.mean_abs = sum / values;
  result.psnr_db = squares > 0 ? 10 * std::log10(255.0 * 255.0 * values / squares)
                               : std::numeric_limits<double>::infinity();
  return result;
}

double structural_similarity(const Rgb8Image& a, const Rgb8Image& b,
                             const std::vector<std::uint8_t>& mask) {
  check_sizes(a, b, mask);
  const int w = a.width, h = a.height;
  const Plane x = luma(a), y = luma(b);
  const Plane mx = blurred(x, w, h), my = blurred(y, w, h);
  const Plane xx = blurred(product(x, x), w, h), yy = blurred(product(y, y), w, h),
              xy = blurred(product(x, y), w, h);
  constexpr double kC1 = (0.01 * 255) * (0.01 * 255), kC2 = (0.03 * 255) * (0.03 * 255);
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!mask.empty() && mask[i] == 0) continue;
    const double vx = xx[i] - mx[i] * mx[i], vy = yy[i] - my[i] * my[i],
                 cov = xy[i] - mx[i] * my[i];
    sum += (2 * mx[i] * my[i] + kC1) * (2 * cov + kC2) /
           ((mx[i] * mx[i] + my[i] * my[i] + kC1) * (vx + vy + kC2));
    ++count;
  }
  return count > 0 ? sum / static_cast<double>(count) : 1.0;
}

}  // namespace organbake
