// SPDX-License-Identifier: GPL-3.0-or-later
#include "color/color_scene.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <opencv2/ml.hpp>

namespace organbake {
namespace {

// One row a pixel. Lightness counts half: it is what shadows change.
cv::Mat lab_rows(const Rgb8Image& picture, int factor) {
  constexpr double kBlur_px = 0.35;  // the borders between kinds are no kind of their own
  constexpr float kLightness = 0.5f;
  constexpr double kGrain = 0.5;  // of Lab's units, of which 2.3 are a difference to the eye
  const cv::Mat bytes(picture.height, picture.width, CV_8UC3,
                      const_cast<std::uint8_t*>(picture.pixels.data()));
  cv::Mat small, lab;
  bytes.convertTo(small, CV_32F, 1.0 / 255);
  cv::resize(small, small, {picture.width / factor, picture.height / factor}, 0, 0, cv::INTER_AREA);
  cv::GaussianBlur(small, small, {}, kBlur_px);
  cv::cvtColor(small, lab, cv::COLOR_RGB2Lab);
  cv::Mat rows = lab.reshape(1, lab.rows * lab.cols);
  rows.col(0) *= kLightness;
  // A colour that is the same everywhere would be a Gaussian of no width.
  cv::Mat noise(rows.size(), CV_32F);
  cv::RNG(19980915).fill(noise, cv::RNG::NORMAL, 0, kGrain);
  return rows + noise;
}

// A mixture is learnt from about so many pixels.
cv::Mat every_nth(const cv::Mat& rows) {
  constexpr int kEnough = 10'000;
  const int step = std::max(1, rows.rows / kEnough) | 1;  // odd: no columns of pixels
  cv::Mat some;
  for (int i = 0; i < rows.rows; i += step) some.push_back(rows.row(i));
  return some;
}

}  // namespace

std::vector<KindShares> color_kinds(const Rgb8Image& picture, int factor) {
  constexpr int kFewest = 20 * kColorKinds;
  if (picture.width / factor * (picture.height / factor) < kFewest) return {};
  const cv::Mat rows = lab_rows(picture, factor);
  cv::theRNG() = cv::RNG(20040902);  // of this thread: it seeds the means
  const auto mixture = cv::ml::EM::create();
  mixture->setClustersNumber(kColorKinds);
  mixture->setCovarianceMatrixType(cv::ml::EM::COV_MAT_DIAGONAL);
  mixture->setTermCriteria({cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 30, 0.01});
  mixture->trainEM(every_nth(rows));
  cv::Mat shares;
  mixture->predict(rows, shares);
  std::vector<KindShares> kinds(static_cast<std::size_t>(rows.rows));
  for (int i = 0; i < rows.rows; ++i)
    for (int k = 0; k < kColorKinds; ++k)
      kinds[static_cast<std::size_t>(i)][k] = static_cast<float>(
          shares.depth() == CV_64F ? shares.at<double>(i, k) : shares.at<float>(i, k));
  return kinds;
}

}  // namespace organbake
