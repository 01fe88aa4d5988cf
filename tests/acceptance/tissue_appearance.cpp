// SPDX-License-Identifier: GPL-3.0-or-later
#include "tissue_appearance.h"

#include <opencv2/imgproc.hpp>

#include "organbake/core/error.h"
#include "support/testing.h"

namespace organbake {
namespace {

// L, a and b of CIE Lab, and what they may be counted for.
struct LabPicture {
  cv::Mat lab;           // CV_32FC3
  cv::Mat tissue, matt;  // CV_8U, 1: in the mask; and no highlight or its glow
  cv::Mat highlights;    // CV_8U
  cv::Mat lightness;     // CV_32F, highlights and surroundings filled by what lies around
};

// Σ weight · value over Σ weight, in a Gaussian window.
cv::Mat lab_blurred(const cv::Mat& value, const cv::Mat& weight, double sigma) {
  cv::Mat sum, total;
  cv::GaussianBlur(value.mul(weight), sum, {}, sigma, sigma, cv::BORDER_REPLICATE);
  cv::GaussianBlur(weight, total, {}, sigma, sigma, cv::BORDER_REPLICATE);
  return sum / cv::max(total, 1e-6);
}

cv::Mat as_float(const cv::Mat& mask) {
  cv::Mat weight;
  mask.convertTo(weight, CV_32F);
  return weight;
}

// A highlight is far brighter than the tissue about it, and nearly white.
cv::Mat lab_highlights(const cv::Mat& lab, const cv::Mat& tissue) {
  constexpr double kAround_px = 12, kBrighter = 22;
  constexpr float kLeast = 45;
  cv::Mat planes[3];
  cv::split(lab, planes);
  const cv::Mat around = lab_blurred(planes[0], as_float(tissue), kAround_px);
  cv::Mat found = (planes[0] - around > kBrighter) & (planes[0] > kLeast);
  return (found & 1).mul(tissue);
}

LabPicture lab_picture(const TissuePicture& picture) {
  const Rgb8Image& image = picture.image;
  const cv::Mat rgb(image.height, image.width, CV_8UC3,
                    const_cast<std::uint8_t*>(image.pixels.data()));
  const cv::Mat mask(image.height, image.width, CV_8U,
                     const_cast<std::uint8_t*>(picture.mask.data()));
  cv::Mat real, small, small_mask;
  rgb.convertTo(real, CV_32FC3, 1.0 / 255);
  const double scale = picture.mm_per_pixel / TissueAppearance::kGrain_mm;
  cv::resize(real, small, {}, scale, scale, cv::INTER_AREA);
  cv::resize(mask, small_mask, small.size(), 0, 0, cv::INTER_NEAREST);
  LabPicture out;
  out.tissue = cv::min(small_mask, 1);
  cv::cvtColor(small, out.lab, cv::COLOR_RGB2Lab);
  if (cv::countNonZero(out.tissue) < 1000)
    throw BadDataError("a picture shows less than a thousand pixels of tissue");
  out.highlights = lab_highlights(out.lab, out.tissue);
  cv::Mat glow;
  cv::dilate(out.highlights, glow, cv::getStructuringElement(cv::MORPH_ELLIPSE, {5, 5}));
  out.matt = out.tissue.mul(1 - glow);
  cv::Mat planes[3];
  cv::split(out.lab, planes);
  const cv::Mat known = as_float(out.matt);
  const cv::Mat around = lab_blurred(planes[0], known, 3);
  out.lightness = planes[0].mul(known) + around.mul(1 - known);
  return out;
}

std::vector<double> values_where(const cv::Mat& plane, const cv::Mat& mask) {
  std::vector<double> values;
  for (int y = 0; y < plane.rows; ++y)
    for (int x = 0; x < plane.cols; ++x)
      if (mask.at<std::uint8_t>(y, x)) values.push_back(plane.at<float>(y, x));
  std::sort(values.begin(), values.end());
  return values;
}

double quantile(const std::vector<double>& sorted, double share) {
  return sorted.empty() ? 0 : sorted[static_cast<std::size_t>(share * (sorted.size() - 1))];
}

// Tissue whose whole window of some pixels is tissue.
cv::Mat inner(const cv::Mat& mask, int radius_px) {
  cv::Mat eroded;
  const int side = 2 * radius_px + 1;
  cv::erode(mask, eroded, cv::getStructuringElement(cv::MORPH_RECT, {side, side}), {-1, -1}, 1,
            cv::BORDER_CONSTANT, 0);
  return eroded;
}

void add_colours(const LabPicture& p, TissueAppearance& a) {
  cv::Mat planes[3];
  cv::split(p.lab, planes);
  for (int c = 0; c < 3; ++c) {
    const std::vector<double> values = values_where(planes[c], p.matt);
    const double middle = c == 0 ? quantile(values, 0.5) : 0;
    for (int k = 0; k < TissueAppearance::kQuantiles; ++k)
      a.lab[c][k] = quantile(values, 0.1 * (k + 1)) - middle;
  }
}

void add_gradients(const LabPicture& p, TissueAppearance& a) {
  cv::Mat dx, dy, length;
  cv::Scharr(p.lightness, dx, CV_32F, 1, 0, 1.0 / 32 / TissueAppearance::kGrain_mm);
  cv::Scharr(p.lightness, dy, CV_32F, 0, 1, 1.0 / 32 / TissueAppearance::kGrain_mm);
  cv::magnitude(dx, dy, length);
  const std::vector<double> values = values_where(length, inner(p.matt, 1));
  for (const double v : values) a.gradient_mean += v / static_cast<double>(values.size());
  a.gradient_p95 = quantile(values, 0.95);
}

// Highlights that lie within some millimetres of each other are one group.
double spread_mm(const cv::Mat& highlights) {
  constexpr int kApart_px = 9;  // 2.7 mm
  cv::Mat joined, labels, stats, centroids;
  cv::dilate(highlights, joined,
             cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * kApart_px + 1, 2 * kApart_px + 1}));
  const int groups = cv::connectedComponents(joined, labels);
  std::vector<cv::Vec4d> sums(static_cast<std::size_t>(groups));  // count, x, y, squares
  for (int y = 0; y < labels.rows; ++y)
    for (int x = 0; x < labels.cols; ++x)
      if (highlights.at<std::uint8_t>(y, x))
        sums[static_cast<std::size_t>(labels.at<int>(y, x))] +=
            cv::Vec4d(1, x, y, double(x) * x + double(y) * y);
  double squares = 0, count = 0;
  for (const cv::Vec4d& s : sums)
    if (s[0] > 0) squares += s[3] - (s[1] * s[1] + s[2] * s[2]) / s[0], count += s[0];
  return TissueAppearance::kGrain_mm * std::sqrt(squares / std::max(count, 1.0));
}

void add_highlights(const LabPicture& p, TissueAppearance& a) {
  const double pixel_mm2 = TissueAppearance::kGrain_mm * TissueAppearance::kGrain_mm;
  const double tissue_px = cv::countNonZero(p.tissue);
  a.highlight_share = cv::countNonZero(p.highlights) / tissue_px;
  cv::Mat labels, stats, centroids;
  const int count = cv::connectedComponentsWithStats(p.highlights, labels, stats, centroids);
  std::vector<double> sizes;
  std::vector<cv::Moments> moments;
  double elongation = 0;
  for (int k = 1; k < count; ++k) {
    sizes.push_back(stats.at<int>(k, cv::CC_STAT_AREA) * pixel_mm2);
    const cv::Moments m = cv::moments(labels == k, true);
    const double half = 0.5 * (m.mu20 + m.mu02) / m.m00 + 1.0 / 12;
    const double off = std::hypot(0.5 * (m.mu20 - m.mu02), m.mu11) / m.m00;
    elongation += std::sqrt((half + off) / std::max(half - off, 1.0 / 12));
  }
  std::sort(sizes.begin(), sizes.end());
  const double all = std::max(std::accumulate(sizes.begin(), sizes.end(), 0.0), pixel_mm2);
  a.highlight_mm2 = sizes;
  a.largest_highlight = sizes.empty() ? 0 : sizes.back() / all;
  a.highlight_spread_mm = spread_mm(p.highlights);
  constexpr double kTenSquareCentimetres_mm2 = 1000;
  a.highlight_count =
      std::log2(1 + sizes.size() * kTenSquareCentimetres_mm2 / (tissue_px * pixel_mm2));
  a.highlight_size = std::log2(std::max(quantile(sizes, 0.5), pixel_mm2));
  a.highlight_elongation = sizes.empty() ? 1 : elongation / static_cast<double>(sizes.size());
}

void add_bands(const LabPicture& p, TissueAppearance& a) {
  const cv::Mat known = as_float(p.tissue);
  cv::Mat fine = p.lightness;
  for (int k = 0; k < TissueAppearance::kOctaves; ++k) {
    const double sigma = 1 << k;
    const cv::Mat coarse = lab_blurred(p.lightness, known, sigma);
    const cv::Mat band = fine - coarse;
    double squares = 0, fourths = 0;
    // At a mask's rim a band tells of what lies beyond: in frames, of other tissue's edge and glow.
    const std::vector<double> values =
        values_where(band, inner(p.tissue, static_cast<int>(sigma)).mul(p.matt));
    for (const double v : values) squares += v * v, fourths += v * v * v * v;
    const auto n = static_cast<double>(std::max<std::size_t>(values.size(), 1));
    a.energy[k] = std::log2(std::max(squares / n, 1e-6));
    a.kurtosis[k] = fourths / n / std::max(squares / n * squares / n, 1e-12);
    fine = coarse;
  }
}

// Along rows and columns, of what differs from ten millimetres' mean.
void add_correlation(const LabPicture& p, TissueAppearance& a) {
  constexpr int kFarthest_px = 30;
  const cv::Mat off = p.lightness - lab_blurred(p.lightness, as_float(p.tissue), 16);
  double at_zero = 0;
  for (int shift = 0; shift <= kFarthest_px; ++shift) {
    double sum = 0, count = 0;
    for (int y = 0; y + shift < off.rows; ++y)
      for (int x = 0; x + shift < off.cols; ++x) {
        if (!p.matt.at<std::uint8_t>(y, x)) continue;
        for (const auto& [u, v] : {std::pair(x + shift, y), std::pair(x, y + shift)}) {
          if (!p.matt.at<std::uint8_t>(v, u)) continue;
          sum += off.at<float>(y, x) * off.at<float>(v, u), ++count;
        }
      }
    const double mean = sum / std::max(count, 1.0);
    if (shift == 0) at_zero = mean;
    a.correlation_mm = shift * TissueAppearance::kGrain_mm;
    if (mean < at_zero / std::exp(1.0)) return;
  }
}

}  // namespace

namespace {

// Kolmogorov and Smirnov's distance of two lists in ascending order.
double most_apart(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.empty() || b.empty()) return a.empty() == b.empty() ? 0 : 1;
  double most = 0;
  const auto share = [](const std::vector<double>& of, double up_to) {
    return double(std::upper_bound(of.begin(), of.end(), up_to) - of.begin()) / double(of.size());
  };
  for (const std::vector<double>* of : {&a, &b})
    for (const double at : *of) most = std::max(most, std::abs(share(a, at) - share(b, at)));
  return most;
}

}  // namespace

TissueAppearance appearance_of(const TissuePicture& picture) {
  const LabPicture lab = lab_picture(picture);
  TissueAppearance a;
  add_colours(lab, a);
  add_gradients(lab, a);
  add_highlights(lab, a);
  add_bands(lab, a);
  add_correlation(lab, a);
  return a;
}

std::vector<TissueAppearancePart> appearance_parts(const TissueAppearance& a,
                                                   const TissueAppearance& b) {
  std::vector<TissueAppearancePart> parts;
  const auto add = [&](std::string name, double distance) {
    parts.push_back({std::move(name), distance});
  };
  constexpr std::array<const char*, 3> kChannels = {"L less its median", "a", "b"};
  for (int c = 0; c < 3; ++c) {
    double sum = 0;
    for (int k = 0; k < TissueAppearance::kQuantiles; ++k)
      sum += std::abs(a.lab[c][k] - b.lab[c][k]) / TissueAppearance::kQuantiles;
    add(std::string("histogram of ") + kChannels[c], sum);
  }
  const auto ratio = [](double x, double y) {
    constexpr double kLeast = 1e-3;
    return std::abs(std::log2((x + kLeast) / (y + kLeast)));
  };
  add("gradient, mean", ratio(a.gradient_mean, b.gradient_mean));
  add("gradient, 95 %", ratio(a.gradient_p95, b.gradient_p95));
  add("highlights, share", ratio(a.highlight_share, b.highlight_share));
  add("highlights, count", std::abs(a.highlight_count - b.highlight_count));
  add("highlights, size", std::abs(a.highlight_size - b.highlight_size));
  add("highlights, sizes (Kolmogorov–Smirnov)", most_apart(a.highlight_mm2, b.highlight_mm2));
  add("highlights, share of the largest", std::abs(a.largest_highlight - b.largest_highlight));
  add("highlights, spread", ratio(a.highlight_spread_mm, b.highlight_spread_mm));
  add("highlights, elongation", std::abs(a.highlight_elongation - b.highlight_elongation));
  for (int k = 0; k < TissueAppearance::kOctaves; ++k) {
    const std::string octave = "octave " + std::to_string(k);
    add(octave + ", energy", std::abs(a.energy[k] - b.energy[k]));
    add(octave + ", kurtosis", ratio(a.kurtosis[k], b.kurtosis[k]));
  }
  add("autocorrelation", ratio(a.correlation_mm, b.correlation_mm));
  return parts;
}

std::vector<TissueAppearancePart> mean_parts(const std::vector<TissueAppearance>& these,
                                             const std::vector<TissueAppearance>& those) {
  std::vector<TissueAppearancePart> mean;
  int pairs = 0;
  for (std::size_t i = 0; i < these.size(); ++i)
    for (std::size_t j = &these == &those ? i + 1 : 0; j < those.size(); ++j, ++pairs) {
      const std::vector<TissueAppearancePart> parts = appearance_parts(these[i], those[j]);
      if (mean.empty())
        mean = parts;
      else
        for (std::size_t k = 0; k < parts.size(); ++k) mean[k].distance += parts[k].distance;
    }
  for (TissueAppearancePart& part : mean) part.distance /= pairs;
  return mean;
}

std::vector<TissueAppearancePart> in_real_differences(
    const std::vector<TissueAppearancePart>& parts, const std::vector<TissueAppearancePart>& real) {
  constexpr double kMost = 5, kLeast = 0.02;
  std::vector<TissueAppearancePart> times = parts;
  for (std::size_t k = 0; k < parts.size(); ++k)
    times[k].distance = std::min(kMost, parts[k].distance / std::max(real[k].distance, kLeast));
  return times;
}

double mean_distance(const std::vector<TissueAppearancePart>& parts) {
  double sum = 0;
  for (const TissueAppearancePart& part : parts) sum += part.distance;
  return sum / static_cast<double>(parts.size());
}

TissuePicture piece_of(const TissuePicture& picture, int x0, int y0, int width, int height) {
  TissuePicture piece{Rgb8Image(width, height), {}, picture.mm_per_pixel};
  for (int y = 0; y < height; ++y) {
    std::copy_n(picture.image.at(x0, y0 + y), 3 * width, piece.image.at(0, y));
    const auto row = picture.mask.begin() + std::ptrdiff_t(y0 + y) * picture.image.width + x0;
    piece.mask.insert(piece.mask.end(), row, row + width);
  }
  return piece;
}

namespace {

// L, a and b, a little smoothed.
void smooth_lab(const Rgb8Image& frame, cv::Mat planes[3]) {
  const cv::Mat rgb(frame.height, frame.width, CV_8UC3,
                    const_cast<std::uint8_t*>(frame.pixels.data()));
  cv::Mat real, lab;
  rgb.convertTo(real, CV_32FC3, 1.0 / 255);
  cv::cvtColor(real, lab, cv::COLOR_RGB2Lab);
  cv::GaussianBlur(lab, lab, {}, 2);
  cv::split(lab, planes);
}

}  // namespace

std::vector<std::uint8_t> bright_mask(const Rgb8Image& frame, const BrightTissue& tissue) {
  cv::Mat planes[3];
  smooth_lab(frame, planes);
  // Highlights are not yellow: what is bright enough counts whatever its hue.
  constexpr double kBlown = 85;
  const cv::Mat bright =
      (planes[0] > tissue.least_l) & ((planes[2] > tissue.least_b) | (planes[0] > kBlown));
  std::vector<std::uint8_t> mask(std::size_t(frame.width) * frame.height, 0);
  for (int y = tissue.y0; y < tissue.y1; ++y)
    for (int x = tissue.x0; x < tissue.x1; ++x)
      mask[std::size_t(y) * frame.width + x] = bright.at<std::uint8_t>(y, x) != 0;
  return mask;
}

std::vector<std::uint8_t> liver_mask(const Rgb8Image& frame) {
  cv::Mat planes[3];
  smooth_lab(frame, planes);
  const cv::Mat red = (planes[0] > 14) & (planes[0] < 42) & (planes[1] > 14) & (planes[1] < 45) &
                      (planes[2] < 26) & (planes[2] < planes[1]);
  cv::Mat closed, labels, stats, centroids;
  cv::morphologyEx(red, closed, cv::MORPH_CLOSE,
                   cv::getStructuringElement(cv::MORPH_ELLIPSE, {25, 25}));
  cv::erode(closed, closed, cv::getStructuringElement(cv::MORPH_ELLIPSE, {13, 13}));
  const int count = cv::connectedComponentsWithStats(closed, labels, stats, centroids);
  std::vector<std::uint8_t> mask(std::size_t(frame.width) * frame.height, 0);
  const int least = frame.width * frame.height / 50;
  for (int y = 0; y < frame.height; ++y)
    for (int x = 0; x < frame.width; ++x) {
      const int label = labels.at<int>(y, x);
      mask[std::size_t(y) * frame.width + x] =
          label > 0 && label < count && stats.at<int>(label, cv::CC_STAT_AREA) >= least;
    }
  return mask;
}

}  // namespace organbake
