// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/motion/feature_tracker.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "optical_flow.h"
#include "organbake/core/error.h"
#include "organbake/shading/cv_grid.h"

namespace organbake {
namespace {

// Fewer survivors of a step are another shot, not a fast move.
constexpr double kCutSurvivors = 0.15;
constexpr std::size_t kFewestToSeeACut = 100;

}  // namespace

void TrackingOptions::check() const {
  if (!(features >= 50 && features <= 100000))
    throw UsageError("features is " + std::to_string(features) + "; it must be in 50…100000");
  if (refill_every < 1)
    throw UsageError("refill_every is " + std::to_string(refill_every) + "; it must be at least 1");
  if (!(most_apart_px > 0 && most_apart_px <= 10))
    throw UsageError("most_apart_px must be above 0 and at most 10");
}

struct FeatureTracker::Impl {
  TrackingOptions options;
  ClipTracks clip;
  FlowPyramid before;
  std::vector<std::size_t> alive;  // of clip.tracks, those that are in the last frame

  void follow(const FlowPyramid& now, const Mask& usable) {
    std::vector<Eigen::Vector2f> here;
    for (const std::size_t track : alive) here.push_back(clip.tracks[track].pixels.back());
    const auto found = follow_points(before, now, here, {}, options.most_apart_px);
    std::vector<std::size_t> kept;
    for (std::size_t i = 0; i < alive.size(); ++i) {
      if (!found[i] || !is_usable(usable, *found[i])) continue;
      clip.tracks[alive[i]].pixels.push_back(*found[i]);
      kept.push_back(alive[i]);
    }
    if (alive.size() >= kFewestToSeeACut &&
        static_cast<double>(kept.size()) < kCutSurvivors * static_cast<double>(alive.size()))
      begin_shot(kept);
    alive = std::move(kept);
  }

  // What seemed to go on over a cut goes on by chance.
  void begin_shot(std::vector<std::size_t>& kept) {
    for (const std::size_t track : kept) clip.tracks[track].pixels.pop_back();
    kept.clear();
    clip.shots.push_back(clip.frames);
  }

  // New corners where there are no features, as far apart as so many of them lie evenly.
  void refill(const Grid<std::uint8_t>& picture, const Mask& usable) {
    const int missing = options.features - static_cast<int>(alive.size());
    if (missing <= 0) return;
    cv::Mat free = cv_view(usable).clone();
    const double area = cv::countNonZero(free);
    const int apart = std::max(3, static_cast<int>(0.7 * std::sqrt(area / options.features)));
    for (const std::size_t track : alive) {
      const Eigen::Vector2f& p = clip.tracks[track].pixels.back();
      cv::circle(free, cv::Point(static_cast<int>(p.x()), static_cast<int>(p.y())), apart, 0,
                 cv::FILLED);
    }
    std::vector<cv::Point2f> corners;
    constexpr double kFaintest = 0.001;  // of the strongest corner: smooth tissue has faint ones
    constexpr int kBlock_px = 5;
    cv::goodFeaturesToTrack(cv_view(picture), corners, missing, kFaintest, apart, free, kBlock_px);
    for (const cv::Point2f& corner : corners) {
      alive.push_back(clip.tracks.size());
      clip.tracks.push_back({clip.frames, {Eigen::Vector2f(corner.x + 0.5F, corner.y + 0.5F)}});
    }
  }
};

FeatureTracker::FeatureTracker(const TrackingOptions& options) : impl_(std::make_unique<Impl>()) {
  options.check();
  impl_->options = options;
}
FeatureTracker::~FeatureTracker() = default;
FeatureTracker::FeatureTracker(FeatureTracker&&) noexcept = default;

void FeatureTracker::add(const Grid<std::uint8_t>& picture, const Mask& usable) {
  ClipTracks& clip = impl_->clip;
  if (clip.frames == 0) {
    clip.width = picture.width;
    clip.height = picture.height;
    clip.shots = {0};
  }
  if (picture.width != clip.width || picture.height != clip.height || usable.width != clip.width ||
      usable.height != clip.height)
    throw BadDataError("frame " + std::to_string(clip.frames) +
                       " or its mask has another size than the frames before");
  FlowPyramid now(picture);
  const std::size_t shots = clip.shots.size();
  impl_->follow(now, usable);
  if (clip.frames % impl_->options.refill_every == 0 || clip.shots.size() != shots)
    impl_->refill(picture, usable);
  impl_->before = std::move(now);
  ++clip.frames;
}

const ClipTracks& FeatureTracker::clip() const { return impl_->clip; }

ClipTracks FeatureTracker::take() {
  impl_->alive.clear();
  impl_->before = {};
  return std::exchange(impl_->clip, {});
}

}  // namespace organbake
