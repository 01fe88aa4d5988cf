// SPDX-License-Identifier: GPL-3.0-or-later
//
// Features of the tissue, followed from frame to frame: corners (Shi & Tomasi 1994) by pyramidal
// Lucas–Kanade (Bouguet 2000), each step checked by tracking it backwards, where tissue is to be
// seen. In: frames one after another. Out: tracks, and where the clip was cut.
#include "organbake/motion/feature_tracker.h"

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <utility>

#include "organbake/core/error.h"
#include "organbake/core/quantile.h"
#include "organbake/shading/cv_grid.h"
#include "organbake/shading/masks.h"
#include "organbake/shading/prepared_frame.h"
#include "two_views.h"

namespace organbake {
TrackedMotion motion_between(const ClipTracks& clip, std::size_t from, std::size_t to) {
  std::vector<float> lengths;
  for (const FeatureTrack& track : clip.tracks)
    if (track.is_in(from) && track.is_in(to))
      lengths.push_back((track.at(to) - track.at(from)).norm());
  if (lengths.empty()) return {};
  const std::size_t features = lengths.size();
  return {median(std::move(lengths)), features};
}

Grid<std::uint8_t> tracked_picture(const Rgb8Image& frame) {
  Grid<std::uint8_t> even(frame.width, frame.height);
  cv::Mat green, target = cv_view(even);
  cv::extractChannel(cv_view(frame), green, 1);
  cv::createCLAHE(3.0, cv::Size(8, 8))->apply(green, target);
  return even;
}

namespace {

// Features at the rim are of the stop, not of tissue: their window reaches over it.
constexpr int kRim = 80;  // of the width one such part

// The border of a field inside the picture, but for where it runs along the field's own bounding
// box: recorders cut the circle off, and leave dark lines at the picture's edges.
std::vector<Eigen::Vector2d> round_border(const Mask& field) {
  Eigen::AlignedBox2i box;
  for (int y = 0; y < field.height; ++y)
    for (int x = 0; x < field.width; ++x)
      if (field.at(x, y)) box.extend(Eigen::Vector2i(x, y));
  if (box.isEmpty()) return {};
  const int rim = std::max(1, field.width / kRim);
  std::vector<Eigen::Vector2d> border;
  for (int y = box.min().y() + rim; y <= box.max().y() - rim; ++y)
    for (int x = box.min().x() + rim; x <= box.max().x() - rim; ++x)
      if (field.at(x, y) && (!field.at(x - 1, y) || !field.at(x + 1, y) || !field.at(x, y - 1) ||
                             !field.at(x, y + 1)))
        border.emplace_back(x + 0.5, y + 0.5);
  return border;
}

// The centre of the circle that a field's border lies on (Kåsa 1976); nothing where it lies on
// none, or on too short an arc to tell.
std::optional<Eigen::Vector2d> circle_center(const Mask& field) {
  constexpr double kOn = 0.015, kNearlyAll = 0.8;  // of the radius; of the border
  // Least eigenvalue of what directions tell of centre and radius; half a circle has 0.09.
  constexpr double kTold = 0.1;
  constexpr double kArc = 0.125;  // of the whole circle; four corners of a window lie on one, too
  const std::vector<Eigen::Vector2d> border = round_border(field);
  std::vector<Eigen::Vector2d> on = border;
  Eigen::Vector2d center = Eigen::Vector2d::Zero();
  double radius = 0;
  Eigen::Matrix3d told = Eigen::Matrix3d::Zero();
  // Twice more without what dark tissue and letters break out of the circle.
  for (int pass = 0; pass < 3 && on.size() >= 3; ++pass) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (const Eigen::Vector2d& p : on) {
      const Eigen::Vector3d row(p.x(), p.y(), 1);
      normal += row * row.transpose();
      right += p.squaredNorm() * row;
    }
    const Eigen::Vector3d circle = normal.ldlt().solve(right);
    center = 0.5 * circle.head<2>();
    radius = std::sqrt(std::max(0.0, circle.z() + center.squaredNorm()));
    on.clear();
    told.setZero();
    for (const Eigen::Vector2d& p : border) {
      if (std::abs((p - center).norm() - radius) > kOn * radius) continue;
      on.push_back(p);
      const Eigen::Vector2d direction = (p - center).normalized();
      const Eigen::Vector3d row(direction.x(), direction.y(), 1);
      told += row * row.transpose();
    }
  }
  const auto size = static_cast<double>(on.size());
  constexpr double kTurn = 2 * std::numbers::pi;
  if (size < std::max(kArc * kTurn * radius, kNearlyAll * double(border.size())) || size < 3)
    return std::nullopt;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(told / size);
  if (eigen.eigenvalues()[0] < kTold) return std::nullopt;
  return center;
}

}  // namespace

UsablePixels::UsablePixels(std::size_t look_every, const Mask& insets) : look_every_(look_every) {
  if (insets.size() > 0)
    insets_ = at_size(insets, std::max(1, insets.width / 2), std::max(1, insets.height / 2));
}

void UsablePixels::look_for_what_is_slow(const Rgb8Image& half) {
  field_ = field_of_view(half, 2);
  ++looked_;
  if (const auto center = circle_center(field_)) {
    centers_ += *center;
    ++round_;
  }
  // Their border is as far to keep from as the stop's.
  if (insets_.size() > 0) field_ = without(std::move(field_), insets_);
  const std::optional<Mask> found = find_instruments(half, field_);
  colourless_ = !found;
  const Mask instruments = found.value_or(Mask(half.width, half.height));
  instruments_now_ = share_of(instruments);
  slow_ = without(eroded(field_, std::max(2, half.width / kRim)), dilated(instruments, 4));
}

std::optional<Eigen::Vector2d> UsablePixels::stop_center() const {
  if (2 * round_ <= looked_) return std::nullopt;
  return 2 * centers_ / static_cast<double>(round_);
}

Mask UsablePixels::next(const Rgb8Image& frame) {
  const Rgb8Image half = half_size(frame);
  if (count_++ % look_every_ == 0) look_for_what_is_slow(half);
  const Mask usable = without(slow_, dilated(find_highlights(half, field_), 2));
  return at_size(usable, frame.width, frame.height);
}

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

FlowPyramid flow_pyramid(const Grid<std::uint8_t>& picture) {
  FlowPyramid levels;
  cv::buildOpticalFlowPyramid(cv_view(picture), levels, kWindow, kPyramidLevels);
  return levels;
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
  cv::calcOpticalFlowPyrLK(from, to, here, there, forward, cv::noArray(), kWindow,
                           guessed ? kGuessedLevels : kPyramidLevels, kConverged,
                           guessed ? cv::OPTFLOW_USE_INITIAL_FLOW : 0);
  cv::calcOpticalFlowPyrLK(to, from, there, back, backward, cv::noArray(), kWindow, kGuessedLevels,
                           kConverged, cv::OPTFLOW_USE_INITIAL_FLOW);
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

namespace {

// Fewer survivors of a step are another shot, not a fast move.
constexpr double kCutSurvivors = 0.15;
constexpr std::size_t kFewestToSeeACut = 100;

}  // namespace

struct FeatureTracker::Impl {
  TrackingOptions options;
  ClipTracks clip;
  FlowPyramid before;
  std::vector<std::size_t> alive;  // of clip.tracks, those that are in the last frame
  std::size_t filled = 0;          // how many were alive after the last refill
  double aim = 0;                  // features after a refill, so that enough are left at the next

  void follow(const FlowPyramid& now, const Mask& usable) {
    std::vector<Eigen::Vector2f> here;
    for (const std::size_t track : alive) here.push_back(clip.tracks[track].pixels.back());
    // From frame to frame, not from where a feature was first seen: light and view change its
    // looks.
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

  // Smooth, dark or blurred tissue holds few of the features that it is given: it is given more, so
  // that half of those that are aimed at are left when they are replaced.
  void aim_by_survivors() {
    constexpr double kLeft = 0.5, kMostTimes = 10;
    if (filled == 0) return;
    const double survivors = static_cast<double>(alive.size()) / static_cast<double>(filled);
    const double wanted =
        options.features * std::clamp(kLeft / std::max(1e-3, survivors), 1.0, kMostTimes);
    // Down by halves: one steady spell promises no other.
    aim = std::max(wanted, 0.5 * (aim + wanted));
  }

  // Not only in turn, but at once where most are lost.
  bool needs_refill(bool cut) const {
    return cut || clip.frames % options.refill_every == 0 ||
           (2 * alive.size() < filled && 2 * alive.size() < aim);
  }

  // New corners where there are no features, as far apart as so many of them lie evenly.
  void refill(const Grid<std::uint8_t>& picture, const Mask& usable) {
    aim_by_survivors();
    add_corners(picture, usable);
    filled = alive.size();
  }

  void add_corners(const Grid<std::uint8_t>& picture, const Mask& usable) {
    const int missing = static_cast<int>(aim) - static_cast<int>(alive.size());
    if (missing <= 0) return;
    cv::Mat free = cv_view(usable).clone();
    const double area = cv::countNonZero(free);
    const int apart = std::max(3, static_cast<int>(0.7 * std::sqrt(area / aim)));
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
  impl_->options = options;
  impl_->aim = options.features;
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
  FlowPyramid now = flow_pyramid(picture);
  const std::size_t shots = clip.shots.size();
  impl_->follow(now, usable);
  if (impl_->needs_refill(clip.shots.size() != shots)) impl_->refill(picture, usable);
  impl_->before = std::move(now);
  ++clip.frames;
}

const ClipTracks& FeatureTracker::clip() const { return impl_->clip; }

ClipTracks FeatureTracker::take() {
  impl_->alive.clear();
  impl_->before = {};
  impl_->filled = 0;
  impl_->aim = impl_->options.features;
  return std::exchange(impl_->clip, {});
}

}  // namespace organbake
