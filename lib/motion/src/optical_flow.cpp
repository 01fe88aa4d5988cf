// SPDX-License-Identifier: GPL-3.0-or-later
#include "optical_flow.h"

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "organbake/shading/cv_grid.h"

namespace organbake {
namespace {

using FlowPoints = std::vector<cv::Point2f>;

constexpr int kPyramidLevels = 3;  // above the finest: steps of a twentieth of the width are found
const cv::Size kWindow(17, 17);
const cv::TermCriteria kConverged(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 15, 0.03);

// OpenCV counts from the first pixel's centre.
FlowPoints in_opencv(const std::vector<Eigen::Vector2f>& points) {
  FlowPoints converted;
  converted.reserve(points.size());
  for (const Eigen::Vector2f& p : points) converted.emplace_back(p.x() - 0.5F, p.y() - 0.5F);
  return converted;
}

}  // namespace

FlowPyramid::FlowPyramid(const Grid<std::uint8_t>& picture) {
  cv::buildOpticalFlowPyramid(cv_view(picture), levels_, kWindow, kPyramidLevels);
}

std::vector<std::optional<Eigen::Vector2f>> follow_points(
    const FlowPyramid& from, const FlowPyramid& to, const std::vector<Eigen::Vector2f>& points,
    const std::vector<Eigen::Vector2f>& guesses, double most_apart_px) {
  std::vector<std::optional<Eigen::Vector2f>> found(points.size());
  if (points.empty()) return found;
  const FlowPoints here = in_opencv(points);
  FlowPoints there = in_opencv(guesses), back = here;
  // From a guess, and back to where it must end, the pyramid's top has nothing to find any more.
  constexpr int kGuessedLevels = 1;
  const bool guessed = !guesses.empty();
  std::vector<std::uint8_t> forward, backward;
  cv::calcOpticalFlowPyrLK(from.levels(), to.levels(), here, there, forward, cv::noArray(), kWindow,
                           guessed ? kGuessedLevels : kPyramidLevels, kConverged,
                           guessed ? cv::OPTFLOW_USE_INITIAL_FLOW : 0);
  cv::calcOpticalFlowPyrLK(to.levels(), from.levels(), there, back, backward, cv::noArray(),
                           kWindow, kGuessedLevels, kConverged, cv::OPTFLOW_USE_INITIAL_FLOW);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const cv::Point2f gap = back[i] - here[i];
    if (forward[i] && backward[i] && std::hypot(gap.x, gap.y) <= most_apart_px)
      found[i] = Eigen::Vector2f(there[i].x + 0.5F, there[i].y + 0.5F);
  }
  return found;
}

bool is_usable(const Mask& usable, const Eigen::Vector2f& point) {
  const int x = static_cast<int>(std::floor(point.x())),
            y = static_cast<int>(std::floor(point.y()));
  return x >= 0 && y >= 0 && x < usable.width && y < usable.height && usable.at(x, y) != 0;
}

}  // namespace organbake
