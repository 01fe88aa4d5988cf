// SPDX-License-Identifier: GPL-3.0-or-later
// Tissues differ by how much more red than green they throw back: a liver's five times as much,
// fat's and a gallbladder's twice. The light on them changes that little, so brightness is not
// asked.
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <span>

#include "organbake/capture/exemplar.h"
#include "organbake/image/srgb.h"

namespace organbake {
namespace {

using Eigen::Vector3f;

struct HuedPixel {
  float hue;  // log of red over green
  Vector3f color;
};

// In the mask, neither dark nor white, each as the mean of the pixels about it: noise has hues,
// too.
std::vector<HuedPixel> hued_pixels(const ExemplarPhoto& photo) {
  constexpr double kAround_px = 3;
  constexpr int kDark = 10, kWhite = 200;  // levels
  constexpr float kLeastColor = 2e-4f;
  const Rgb8Image& image = photo.image;
  cv::Mat color(image.height, image.width, CV_32FC3, cv::Scalar::all(0));
  cv::Mat weight(image.height, image.width, CV_32F, cv::Scalar(0));
  for (int i = 0; i < image.width * image.height; ++i) {
    const std::uint8_t* rgb = &image.pixels[std::size_t(3) * i];
    const bool masked = photo.mask.empty() || photo.mask[i] != 0;
    if (!masked || std::max({rgb[0], rgb[1], rgb[2]}) < kDark) continue;
    if (std::min({rgb[0], rgb[1], rgb[2]}) >= kWhite) continue;
    weight.at<float>(i) = 1;
    for (int c = 0; c < 3; ++c) color.at<cv::Vec3f>(i)[c] = linear_from_srgb8()[rgb[c]];
  }
  cv::Mat sums, weights;
  cv::GaussianBlur(color, sums, {}, kAround_px, kAround_px, cv::BORDER_CONSTANT);
  cv::GaussianBlur(weight, weights, {}, kAround_px, kAround_px, cv::BORDER_CONSTANT);
  std::vector<HuedPixel> pixels;
  for (int i = 0; i < image.width * image.height; ++i) {
    if (weight.at<float>(i) == 0) continue;
    const cv::Vec3f mean = sums.at<cv::Vec3f>(i) / weights.at<float>(i);
    const Vector3f c = Vector3f(mean[0], mean[1], mean[2]).cwiseMax(kLeastColor);
    pixels.push_back({std::log(c[0] / c[1]), c});
  }
  return pixels;
}

// Where sorted pixels are best cut in two (Otsu 1979), if their halves then differ as tissues do
// and neither is small; else 0.
std::size_t cut_between_tissues(std::span<const HuedPixel> sorted, std::size_t least) {
  const double kApart = std::log(1.9);  // a liver's two lobes in one light: 1.7
  double sum = 0, below = 0, best = 0;
  for (const HuedPixel& p : sorted) sum += p.hue;
  std::size_t cut = 0;
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    below += sorted[i - 1].hue;
    const double low = static_cast<double>(i), high = static_cast<double>(sorted.size() - i);
    const double apart = (sum - below) / high - below / low;
    if (i < least || sorted.size() - i < least || apart < kApart) continue;
    if (low * high * apart * apart > best) best = low * high * apart * apart, cut = i;
  }
  return cut;
}

void add_tissues(std::span<const HuedPixel> sorted, std::size_t all,
                 std::vector<ShownTissue>& tissues) {
  constexpr double kLeastShare = 0.05;
  const auto least = static_cast<std::size_t>(std::ceil(kLeastShare * static_cast<double>(all)));
  if (const std::size_t cut = cut_between_tissues(sorted, least); cut > 0) {
    add_tissues(sorted.first(cut), all, tissues);
    add_tissues(sorted.subspan(cut), all, tissues);
    return;
  }
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const HuedPixel& p : sorted) mean += p.color.cast<double>();
  mean /= static_cast<double>(std::max<std::size_t>(1, sorted.size()));
  tissues.push_back(
      {static_cast<double>(sorted.size()) / static_cast<double>(all), mean.cast<float>()});
}

}  // namespace

std::vector<ShownTissue> tissues_shown(const ExemplarPhoto& photo) {
  std::vector<HuedPixel> pixels = hued_pixels(photo);
  std::stable_sort(pixels.begin(), pixels.end(),
                   [](const HuedPixel& a, const HuedPixel& b) { return a.hue < b.hue; });
  std::vector<ShownTissue> tissues;
  if (!pixels.empty()) add_tissues(pixels, pixels.size(), tissues);
  std::stable_sort(tissues.begin(), tissues.end(),
                   [](const ShownTissue& a, const ShownTissue& b) { return a.share > b.share; });
  return tissues;
}

}  // namespace organbake
