// SPDX-License-Identifier: GPL-3.0-or-later
// Texture by example with histogram-preserving blending (Heitz and Neyret 2018). In: a photograph
// of a tissue, and its mask. Out: colours as normal scores, whose blends keep their variance, and a
// table that brings them back. Light is taken out of the photograph first, by the luminance of a
// wide neighbourhood; and it is told which tissues a mask holds.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <span>

#include "organbake/capture/surface_color.h"
#include "organbake/core/error.h"
#include "organbake/core/quantile.h"
#include "organbake/image/srgb.h"

namespace organbake {
namespace {

using Eigen::Vector3f;

constexpr float kWidest = 3.5f;  // scores beyond are as this one

float luminance_of(const Vector3f& c) { return luminance(c[0], c[1], c[2]); }

[[noreturn]] void refuse(const std::string& why) {
  throw BadDataError("the exemplar " + why + ": choose a frame, or a mask, that shows the tissue " +
                     "well lit, at least some 40 × 40 pixels of it in one piece");
}

// The value that a standard normal one stays below with probability p: Acklam's rational
// approximation, 1.2e-9 relative.
double normal_quantile(double p) {
  constexpr double a[] = {-3.969683028665376e+01, 2.209460984245205e+02,  -2.759285104469687e+02,
                          1.383577518672690e+02,  -3.066479806614716e+01, 2.506628277459239e+00};
  constexpr double b[] = {-5.447609879822406e+01, 1.615858368580409e+02, -1.556989798598866e+02,
                          6.680131188771972e+01, -1.328068155288572e+01};
  constexpr double c[] = {-7.784894002430293e-03, -3.223964580411365e-01, -2.400758277161838e+00,
                          -2.549732539343734e+00, 4.374664141464968e+00,  2.938163982698783e+00};
  constexpr double d[] = {7.784695709041462e-03, 3.224671290700398e-01, 2.445134137142996e+00,
                          3.754408661907416e+00};
  constexpr double kLow = 0.02425;
  if (p > 1 - kLow) return -normal_quantile(1 - p);
  if (p < kLow) {
    const double q = std::sqrt(-2 * std::log(p));
    return (((((c[0] * q + c[1]) * q + c[2]) * q + c[3]) * q + c[4]) * q + c[5]) /
           ((((d[0] * q + d[1]) * q + d[2]) * q + d[3]) * q + 1);
  }
  const double q = p - 0.5, r = q * q;
  return (((((a[0] * r + a[1]) * r + a[2]) * r + a[3]) * r + a[4]) * r + a[5]) * q /
         (((((b[0] * r + b[1]) * r + b[2]) * r + b[3]) * r + b[4]) * r + 1);
}

double share_below(float score) { return 0.5 * std::erfc(-score / std::sqrt(2.0)); }

float median_luminance(const std::vector<Vector3f>& pixels,
                       const std::vector<std::uint8_t>& usable) {
  std::vector<float> values;
  for (std::size_t i = 0; i < pixels.size(); ++i)
    if (usable[i]) values.push_back(luminance_of(pixels[i]));
  return median(std::move(values));
}

// Takes what lies within radius_px of an unusable pixel of the tissue out, too.
void widen_gaps(std::vector<std::uint8_t>& usable, const std::vector<std::uint8_t>& bright,
                int width, int height, int radius_px) {
  cv::Mat gaps(height, width, CV_8U, const_cast<std::uint8_t*>(bright.data())), wide;
  const int side = 2 * radius_px + 1;
  cv::dilate(gaps, wide, cv::getStructuringElement(cv::MORPH_ELLIPSE, {side, side}));
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      if (wide.at<std::uint8_t>(y, x)) usable[std::size_t(y) * width + x] = 0;
}

}  // namespace

Exemplar::Exemplar(const ExemplarPhoto& photo) : mm_per_pixel_(photo.mm_per_pixel) {
  require(mm_per_pixel_ >= 0.001 && mm_per_pixel_ <= 10, "exemplar_mm_per_pixel", mm_per_pixel_,
          "take 0.001…10 mm, the size of the exemplar's pixels on the tissue");
  std::vector<std::uint8_t> usable;
  keep(photo, usable);
  take_light_out(usable);
  find_places(usable);
  make_scores(usable);
}

// Linear colours, and which of them are tissue: in the mask, neither dark nor highlights nor within
// four pixels of one.
void Exemplar::keep(const ExemplarPhoto& photo, std::vector<std::uint8_t>& usable) {
  constexpr float kHighlight = 2.2f;                       // of the median luminance
  constexpr int kClipped = 252, kDark = 10, kGlow_px = 4;  // levels; a highlight's glow
  const Rgb8Image& image = photo.image;
  width_ = image.width, height_ = image.height;
  const std::size_t count = std::size_t(width_) * height_;
  if (!photo.mask.empty() && photo.mask.size() != count)
    throw BadDataError("the exemplar's mask is not of the exemplar's size, " +
                       std::to_string(width_) + " × " + std::to_string(height_) + " pixels");
  usable.assign(count, 1);
  pixels_.resize(count);
  std::vector<std::uint8_t> bright(count, 0);
  std::size_t masked = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint8_t* rgb = &image.pixels[3 * i];
    for (int c = 0; c < 3; ++c) pixels_[i][c] = linear_from_srgb8()[rgb[c]];
    if (!photo.mask.empty() && photo.mask[i] == 0) usable[i] = 0;
    masked += usable[i];
    const int most = std::max({rgb[0], rgb[1], rgb[2]});
    bright[i] = usable[i] && std::min({rgb[0], rgb[1], rgb[2]}) >= kClipped;
    if (most < kDark) usable[i] = 0;
  }
  const float limit = kHighlight * median_luminance(pixels_, usable);
  std::size_t highlights = 0;
  for (std::size_t i = 0; i < count; ++i) {
    bright[i] |= usable[i] && luminance_of(pixels_[i]) > limit;
    highlights += bright[i];
  }
  highlight_share_ = masked > 0 ? double(highlights) / static_cast<double>(masked) : 0;
  widen_gaps(usable, bright, width_, height_, kGlow_px);
  const auto tissue = std::accumulate(usable.begin(), usable.end(), 0);
  if (tissue < kLeastTissue_px)
    refuse("has " + std::to_string(tissue) + " pixels of tissue in " + std::to_string(masked) +
           " that its mask allows, the others are dark or highlights");
}

// Divides by the luminance of a wide neighbourhood: what changes slowly over tissue of one kind is
// light. The median brightness stays.
void Exemplar::take_light_out(const std::vector<std::uint8_t>& usable) {
  constexpr double kLight_px = 25;
  cv::Mat light(height_, width_, CV_32F), weight(height_, width_, CV_32F);
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x) {
      const std::size_t i = std::size_t(y) * width_ + x;
      weight.at<float>(y, x) = usable[i];
      light.at<float>(y, x) = usable[i] ? luminance_of(pixels_[i]) : 0;
    }
  cv::GaussianBlur(light, light, {}, kLight_px, kLight_px, cv::BORDER_CONSTANT);
  cv::GaussianBlur(weight, weight, {}, kLight_px, kLight_px, cv::BORDER_CONSTANT);
  const float middle = median_luminance(pixels_, usable);
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x) {
      const std::size_t i = std::size_t(y) * width_ + x;
      if (usable[i]) pixels_[i] *= middle * weight.at<float>(y, x) / light.at<float>(y, x);
    }
}

// Places whose squares hold next to nothing but tissue; gaps in them take the nearest tissue's
// colour. The squares are as large as leaves enough places to choose from.
void Exemplar::find_places(const std::vector<std::uint8_t>& usable) {
  constexpr double kTissueShare = 0.93, kLargestReach_mm = 5;
  constexpr int kLeastReach_px = 10, kEvery_px = 2;
  constexpr std::size_t kEnough = 300;
  const cv::Mat tissue(height_, width_, CV_8U, const_cast<std::uint8_t*>(usable.data()));
  cv::Mat sums;
  cv::integral(tissue, sums, CV_32S);
  int reach = std::min(
      {static_cast<int>(kLargestReach_mm / mm_per_pixel_), (width_ - 1) / 2, (height_ - 1) / 2});
  for (; reach >= kLeastReach_px; reach = reach * 9 / 10) {
    places_.clear();
    const int side = 2 * reach + 1;
    for (int y = reach; y + reach < height_; y += kEvery_px)
      for (int x = reach; x + reach < width_; x += kEvery_px) {
        const int inside =
            sums.at<int>(y + reach + 1, x + reach + 1) - sums.at<int>(y - reach, x + reach + 1) -
            sums.at<int>(y + reach + 1, x - reach) + sums.at<int>(y - reach, x - reach);
        if (inside >= kTissueShare * side * side) places_.push_back({x, y});
      }
    if (places_.size() >= kEnough) break;
  }
  if (places_.size() < kEnough) refuse("has no piece of tissue that is large enough to copy from");
  reach_px_ = reach - 1;  // interpolation asks for one more
  // The nearest tissue's pixel by a distance transform that knows it.
  cv::Mat gaps = 1 - tissue, distances, labels;
  cv::distanceTransform(gaps, distances, labels, cv::DIST_L2, cv::DIST_MASK_5,
                        cv::DIST_LABEL_PIXEL);
  std::vector<std::size_t> at(
      static_cast<std::size_t>(std::accumulate(usable.begin(), usable.end(), 0)) + 1);
  for (std::size_t i = 0; i < usable.size(); ++i)
    if (usable[i])
      at[labels.at<int>(static_cast<int>(i / width_), static_cast<int>(i % width_))] = i;
  const std::vector<Vector3f> before = pixels_;
  for (std::size_t i = 0; i < usable.size(); ++i)
    pixels_[i] =
        before[at[labels.at<int>(static_cast<int>(i / width_), static_cast<int>(i % width_))]];
}

void Exemplar::make_scores(const std::vector<std::uint8_t>& usable) {
  std::vector<std::size_t> at;
  for (std::size_t i = 0; i < usable.size(); ++i)
    if (usable[i]) at.push_back(i);
  for (const std::size_t i : at) tissue_.push_back(pixels_[i]);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Vector3f& c : tissue_) mean += c.cast<double>();
  mean /= static_cast<double>(tissue_.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Vector3f& c : tissue_) {
    const Eigen::Vector3d off = c.cast<double>() - mean;
    spread += off * off.transpose();
  }
  mean_ = mean.cast<float>();
  axes_ = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().cast<float>();
  for (Vector3f& pixel : pixels_) pixel = axes_.transpose() * (pixel - mean_);
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<float> values;
    for (const std::size_t i : at) values.push_back(pixels_[i][axis]);
    std::sort(values.begin(), values.end());
    const auto count = static_cast<double>(values.size());
    for (int k = 0; k <= kTable; ++k) {
      const float score = kWidest * (2 * static_cast<float>(k) / kTable - 1);
      const double place = share_below(score) * (count - 1);
      const auto low = static_cast<std::size_t>(place);
      const std::size_t high = std::min(low + 1, values.size() - 1);
      const auto share = static_cast<float>(place - static_cast<double>(low));
      table_[axis][k] = values[low] + share * (values[high] - values[low]);
    }
    for (Vector3f& pixel : pixels_) {  // equal values get the middle of their ranks
      const auto [first, last] = std::equal_range(values.begin(), values.end(), pixel[axis]);
      const double rank =
          0.5 * static_cast<double>((first - values.begin()) + (last - values.begin()));
      pixel[axis] = static_cast<float>(
          normal_quantile(std::clamp(rank / count, 0.5 / count, 1 - 0.5 / count)));
    }
  }
}

Vector3f Exemplar::scores(std::size_t place, const Eigen::Vector2d& from_place_mm) const {
  const Eigen::Vector2d off = from_place_mm / mm_per_pixel_;
  const double x = places_[place][0] + std::clamp(off.x(), -reach_px_, reach_px_);
  const double y = places_[place][1] + std::clamp(off.y(), -reach_px_, reach_px_);
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const auto u = static_cast<float>(x - x0), v = static_cast<float>(y - y0);
  const Vector3f* const top = &pixels_[std::size_t(y0) * width_ + x0];
  const Vector3f* const below = top + width_;
  return (1 - v) * ((1 - u) * top[0] + u * top[1]) + v * ((1 - u) * below[0] + u * below[1]);
}

Vector3f Exemplar::color(const Vector3f& scores) const {
  Vector3f along;
  for (int axis = 0; axis < 3; ++axis) {
    const float place =
        (std::clamp(scores[axis], -kWidest, kWidest) / kWidest + 1) * (0.5f * kTable);
    const int low = std::min(static_cast<int>(place), kTable - 1);
    const auto& table = table_[axis];
    along[axis] = table[low] + (place - static_cast<float>(low)) * (table[low + 1] - table[low]);
  }
  return (mean_ + axes_ * along).cwiseMax(0).cwiseMin(1);
}

// Tissues differ by how much more red than green they throw back: a liver's five times as much,
// fat's and a gallbladder's twice. The light on them changes that little, so brightness is not
// asked.

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
