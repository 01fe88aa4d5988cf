// SPDX-License-Identifier: GPL-3.0-or-later
// Detail as what a filter takes off: Gaussian or bilateral (Tomasi & Manduchi 1998), of depth and
// of log luminance (Durand & Dorsey 2002). The background is filled with the nearest skin first, or
// outlines would be detail.
#include "organbake/capture/filtered_detail.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "organbake/core/error.h"
#include "organbake/image/srgb.h"

namespace organbake {
namespace {

// Black skin has no logarithm; this much light is none.
constexpr float kBlack = 1e-4f;
// Two stops of light are no detail of one skin, but two tissues, or a highlight.
constexpr double kTonalSigma = 0.4;
// What counts as detail on the surface is no larger: the filters' σ.
constexpr double kDetail_mm = 4;
constexpr double kWidestSigma_px = 32;  // beyond it a filter takes minutes and tells no more

// Every texel's nearest texel of skin, itself for skin.
std::vector<int> nearest_skin(const CameraMaps& maps) {
  cv::Mat background(maps.height, maps.width, CV_8U);
  for (std::size_t i = 0; i < maps.face.size(); ++i)
    background.data[i] = maps.face[i] == kNoFace ? 255 : 0;
  cv::Mat distance, label;
  cv::distanceTransform(background, distance, label, cv::DIST_L2, cv::DIST_MASK_5,
                        cv::DIST_LABEL_PIXEL);
  const auto* labels = label.ptr<int>();
  std::vector<int> texel_of_label(maps.face.size() + 1, 0), nearest(maps.face.size());
  for (std::size_t i = 0; i < nearest.size(); ++i)
    if (background.data[i] == 0) texel_of_label[labels[i]] = static_cast<int>(i);
  for (std::size_t i = 0; i < nearest.size(); ++i) nearest[i] = texel_of_label[labels[i]];
  return nearest;
}

cv::Mat filtered(const cv::Mat& image, MicroSplit split, double sigma_px, double tolerance) {
  cv::Mat result;
  switch (split) {
    case MicroSplit::gaussian:
      cv::GaussianBlur(image, result, {}, sigma_px, sigma_px, cv::BORDER_REPLICATE);
      return result;
    case MicroSplit::bilateral:
      cv::bilateralFilter(image, result, 0, tolerance, sigma_px, cv::BORDER_REPLICATE);
      return result;
    case MicroSplit::proxy:
      break;
  }
  throw UsageError("the split by the proxy is in the maps already; no filter makes it");
}

}  // namespace

ChannelImage filtered_detail(const CameraMaps& maps, const Intrinsics& lens, MicroSplit split) {
  const std::size_t count = maps.face.size();
  std::vector<float> depth(count, 0.0f), intensity(count, 1.0f);
  double depth_sum = 0;
  std::size_t skin = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (maps.face[i] == kNoFace) continue;
    depth_sum += maps.depth_mm[i];
    ++skin;
  }
  if (skin > 0) {
    const std::vector<int> nearest = nearest_skin(maps);
    cv::Mat depths(maps.height, maps.width, CV_32F), tones(maps.height, maps.width, CV_32F);
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Vector3f& color = maps.color[nearest[i]];
      depths.ptr<float>()[i] = maps.depth_mm[nearest[i]];
      tones.ptr<float>()[i] = std::log(std::max(luminance(color[0], color[1], color[2]), kBlack));
    }
    const double mean_depth_mm = depth_sum / static_cast<double>(skin);
    const double sigma_px = std::clamp(kDetail_mm * lens.fx / mean_depth_mm, 0.5, kWidestSigma_px);
    const cv::Mat macro = filtered(depths, split, sigma_px, kDetail_mm);
    const cv::Mat light = filtered(tones, split, sigma_px, kTonalSigma);
    for (std::size_t i = 0; i < count; ++i) {
      if (maps.face[i] == kNoFace) continue;
      depth[i] = maps.depth_mm[i] - macro.ptr<float>()[i];
      intensity[i] = std::exp(tones.ptr<float>()[i] - light.ptr<float>()[i]);
    }
  }
  return {maps.width,
          maps.height,
          {{"Y", std::move(depth), false}, {"intensity", std::move(intensity), true}}};
}

}  // namespace organbake
