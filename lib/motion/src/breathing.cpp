// SPDX-License-Identifier: GPL-3.0-or-later
//
// Whether tissue breathes while the scope moves. In: a rigid scene with all sightings of its
// places, also those that do not agree. Its poses follow the tissue in part; what they cannot
// follow is left as errors, of each view a smooth field over the picture. Two waves of one period
// are fitted to the fields of all views, however these lie in time (Lomb 1976), and each breath is
// foretold by the others (cross-validation; Stone 1974). Out: the period that foretells best, if it
// does so well.
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "organbake/geometry/dense_solve.h"
#include "organbake/motion/scene.h"
#include "two_views.h"

namespace organbake {
namespace {

constexpr int kTerms = 3;  // of a field: flat, but it may lean either way
using Terms = Eigen::Matrix<double, kTerms, 1>;

// Errors of sightings, pixels, as a field over one picture.
struct ErrorField {
  Eigen::Matrix<double, kTerms, kTerms> normal =
      3 * Eigen::Matrix<double, kTerms, kTerms>::Identity();
  Eigen::Matrix<double, kTerms, 2> right = Eigen::Matrix<double, kTerms, 2>::Zero();
  std::size_t sightings = 0;

  void add(const Intrinsics& lens, const Eigen::Vector2d& pixel, const Eigen::Vector2d& error) {
    constexpr double kStray = 0.03;  // of the picture's width: farther off it is another feature
    constexpr double kUsual_px = 3;  // errors beyond weigh less and less (Cauchy)
    if (!(error.norm() <= kStray * lens.width)) return;
    const Eigen::Vector2d from_middle =
        (pixel - Eigen::Vector2d(lens.cx, lens.cy)) / (0.25 * lens.width);
    const Terms terms(1, from_middle.x(), from_middle.y());
    const double weight = 1 / (1 + error.squaredNorm() / (kUsual_px * kUsual_px));
    normal += weight * terms * terms.transpose();
    right += weight * terms * error.transpose();
    ++sightings;
  }
};

// Of each view that tells a field, its frame and the field in a row.
struct Fields {
  std::vector<double> frames;
  Eigen::MatrixXd rows;
};

// Solves normal equations, held a little where their columns look alike.
Eigen::MatrixXd fitted(const Eigen::MatrixXd& normal, const Eigen::MatrixXd& right) {
  constexpr double kHeld = 1e-3;
  return solve_symmetric(normal + kHeld * Eigen::MatrixXd::Identity(normal.rows(), normal.cols()),
                         right);
}

// What is left of each column without a cubic in time: poses and places drift slowly.
Eigen::MatrixXd without_trend(const std::vector<double>& frames, const Eigen::MatrixXd& rows) {
  Eigen::MatrixXd slow(rows.rows(), 4);
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    const double t = 2 * (frames[static_cast<std::size_t>(i)] - frames.front()) /
                         (frames.back() - frames.front()) -
                     1;
    slow.row(i) << 1, t, t * t, t * t * t;
  }
  return rows - slow * fitted(slow.transpose() * slow, slow.transpose() * rows);
}

Fields error_fields(const std::vector<std::size_t>& view_frames, const Scene& scene) {
  constexpr std::size_t kFewestSightings = 30;
  std::vector<ErrorField> of_view(view_frames.size());
  for (const Landmark& landmark : scene.landmarks) {
    if (!landmark.place) continue;
    for (const Sighting& seen : landmark.seen) {
      if (!scene.is_posed(seen.view)) continue;
      const Eigen::Vector3d point = *scene.camera_from_world[seen.view] * *landmark.place;
      if (point.z() > 0)
        of_view[seen.view].add(scene.lens, seen.pixel, seen.pixel - project(scene.lens, point));
    }
  }
  Fields fields{{}, Eigen::MatrixXd(static_cast<Eigen::Index>(of_view.size()), 2 * kTerms)};
  Eigen::Index count = 0;
  for (std::size_t view = 0; view < of_view.size(); ++view) {
    if (of_view[view].sightings < kFewestSightings) continue;
    const Eigen::MatrixXd field = solve_symmetric(of_view[view].normal, of_view[view].right);
    fields.rows.row(count++) = field.reshaped().transpose();
    fields.frames.push_back(static_cast<double>(view_frames[view]));
  }
  fields.rows.conservativeResize(count, Eigen::NoChange);
  return fields;
}

// Each view's waves: a breath is no sine, its rest is longer.
Eigen::MatrixXd waves_of(const std::vector<double>& frames, double period) {
  Eigen::MatrixXd waves(static_cast<Eigen::Index>(frames.size()), 4);
  for (Eigen::Index i = 0; i < waves.rows(); ++i) {
    const double angle =
        2 * std::numbers::pi * (frames[static_cast<std::size_t>(i)] - frames.front()) / period;
    waves.row(i) << std::cos(angle), std::sin(angle), std::cos(2 * angle), std::sin(2 * angle);
  }
  return without_trend(frames, waves);
}

// Share of the fields' variance that the other breaths foretell of each; below 0 where they
// mislead.
double foretold_share(const Fields& fields, double period) {
  constexpr Eigen::Index kFewestOthers = 12;  // views: three for each wave
  const Eigen::MatrixXd waves = waves_of(fields.frames, period);
  const Eigen::MatrixXd normal = waves.transpose() * waves, right = waves.transpose() * fields.rows;
  const auto breath_at = [&](Eigen::Index i) {
    return std::floor((fields.frames[static_cast<std::size_t>(i)] - fields.frames.front()) /
                      period);
  };
  double all = 0, left = 0;
  for (Eigen::Index first = 0, end = 0; first < waves.rows(); first = end) {
    while (end < waves.rows() && breath_at(end) == breath_at(first)) ++end;
    if (waves.rows() - (end - first) < kFewestOthers) continue;
    const Eigen::MatrixXd own = waves.middleRows(first, end - first),
                          seen = fields.rows.middleRows(first, end - first);
    const Eigen::MatrixXd by_others =
        fitted(normal - own.transpose() * own, right - own.transpose() * seen);
    all += seen.squaredNorm();
    left += (seen - own * by_others).squaredNorm();
  }
  return all > 0 ? 1 - left / all : 0;
}

}  // namespace

double breath_period_frames(const std::vector<std::size_t>& view_frames, const Scene& scene) {
  constexpr std::size_t kFewestViews = 30;
  constexpr double kShortest_frames = 8, kViewsInABreath = 6, kFiner = 1.01;
  // One field that wanders at random, in 50 views, comes again by this share in 2 or 3 of a hundred
  // clips, more fields in none; in fewer breaths they do more often.
  constexpr double kForetold = 0.5, kFewestBreaths = 2.85;
  constexpr double kClearly = 0.1;  // twice a period is one, too
  Fields fields = error_fields(view_frames, scene);
  const std::size_t views = fields.frames.size();
  if (views < kFewestViews) return 0;
  fields.rows = without_trend(fields.frames, fields.rows);
  const double span = fields.frames.back() - fields.frames.front();
  double best = 0, most = 0;
  for (double period = std::max(kShortest_frames, kViewsInABreath * span / double(views));
       period * kFewestBreaths < span; period *= kFiner) {
    const double share = foretold_share(fields, period);
    if (share <= most + (best > 0 && period > 1.5 * best ? kClearly : 0)) continue;
    most = share;
    best = period;
  }
  return most > kForetold ? best : 0;
}

}  // namespace organbake
