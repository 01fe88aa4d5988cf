// SPDX-License-Identifier: GPL-3.0-or-later
#include "two_views.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

#include "organbake/core/median.h"

namespace organbake {
namespace {

constexpr std::size_t kFewestPairs = 30;
constexpr double kAgreesWithPair_px =
    1.5;  // tracked to half a pixel, over tissue that is not quite rigid

using RayPoints = std::vector<cv::Point2d>;

RayPoints straight(const Intrinsics& lens, const std::vector<Eigen::Vector2d>& pixels) {
  RayPoints points;
  points.reserve(pixels.size());
  for (const Eigen::Vector2d& pixel : pixels) {
    const Eigen::Vector3d ray = unproject(lens, pixel);
    points.emplace_back(ray.x(), ray.y());
  }
  return points;
}

double parallax_px(const RayPoints& a, const RayPoints& b, double focal_px) {
  cv::Mat inliers;
  const cv::Mat h =
      cv::findHomography(a, b, cv::USAC_MAGSAC, kAgreesWithPair_px / focal_px, inliers, 500);
  if (h.empty()) return 0;
  RayPoints moved;
  cv::perspectiveTransform(a, moved, h);
  std::vector<double> apart;
  for (std::size_t i = 0; i < a.size(); ++i)
    apart.push_back(std::hypot(moved[i].x - b[i].x, moved[i].y - b[i].y) * focal_px);
  const auto upper = apart.begin() + static_cast<std::ptrdiff_t>(apart.size() * 4 / 5);
  std::nth_element(apart.begin(), upper, apart.end());
  return *upper;
}

}  // namespace

TwoViews relate_views(const Intrinsics& lens, const std::vector<Eigen::Vector2d>& first,
                      const std::vector<Eigen::Vector2d>& second) {
  TwoViews result;
  if (first.size() < kFewestPairs) return result;
  const RayPoints a = straight(lens, first), b = straight(lens, second);
  cv::Mat inliers;
  const cv::Mat essential =
      cv::findEssentialMat(a, b, cv::Mat::eye(3, 3, CV_64F), cv::USAC_MAGSAC, 0.999,
                           kAgreesWithPair_px / lens.fx, 1000, inliers);
  if (essential.rows != 3) return result;
  cv::Mat rotation, translation, points;
  constexpr double kFarthest = 1e3;  // baselines
  result.agreeing = static_cast<std::size_t>(
      std::max(0, cv::recoverPose(essential, a, b, cv::Mat::eye(3, 3, CV_64F), rotation,
                                  translation, kFarthest, inliers, points)));
  cv::cv2eigen(rotation, result.second_from_first.rotation);
  cv::cv2eigen(translation, result.second_from_first.translation);
  std::vector<double> angles;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (!inliers.at<std::uint8_t>(static_cast<int>(i))) continue;
    const Eigen::Vector3d ray_a(a[i].x, a[i].y, 1), ray_b(b[i].x, b[i].y, 1);
    const Eigen::Vector3d turned = result.second_from_first.rotation * ray_a;
    angles.push_back(std::atan2(turned.cross(ray_b).norm(), turned.dot(ray_b)));
  }
  result.median_angle_rad = median(std::move(angles));
  result.parallax_px = parallax_px(a, b, lens.fx);
  return result;
}

}  // namespace organbake
