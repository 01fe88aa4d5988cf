// SPDX-License-Identifier: GPL-3.0-or-later
//
// Whether and how tissue breathes while the scope moves. In: a rigid scene with all sightings of
// its places, also those that do not agree. Its poses follow the tissue in part; what they cannot
// follow is left as errors, of each view a smooth field over the picture. Two waves of one period
// are fitted to the fields of all views, however these lie in time (Lomb 1976), and each breath is
// foretold by the others (cross-validation; Stone 1974). Out: the period that foretells best, if it
// does so well; then a deformation of rank one (Bregler et al. 2000), one course in time times one
// smooth field in space, adjusted with poses and places (bundle_adjustment.cpp), and the scene with
// its tissue at rest.
#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "organbake/core/quantile.h"
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

// Of each view that tells a field, how many frames it is after the first, and the field in a row.
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
      const Eigen::Vector3d point =
          *scene.camera_from_world[seen.view] * scene.place_in(seen.view, landmark);
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
    fields.frames.push_back(static_cast<double>(view_frames[view]) -
                            static_cast<double>(view_frames.front()));
  }
  fields.rows.conservativeResize(count, Eigen::NoChange);
  if (count > 1) fields.rows = without_trend(fields.frames, fields.rows);
  return fields;
}

// Each view's waves: a breath is no sine, its rest is longer.
Eigen::MatrixXd waves_of(const std::vector<double>& frames, double period) {
  Eigen::MatrixXd waves(static_cast<Eigen::Index>(frames.size()), Breath::kWaves);
  for (Eigen::Index i = 0; i < waves.rows(); ++i)
    waves.row(i) =
        Breath::waves_at(2 * std::numbers::pi * frames[static_cast<std::size_t>(i)] / period);
  return without_trend(frames, waves);
}

// Squares of the fields of all breaths that others can foretell, and of what these leave of them.
struct Foretold {
  double all = 0, left = 0;
  double share() const { return all > 0 ? 1 - left / all : 0; }  // below 0 where they mislead
};

Foretold foretell(const Fields& fields, double period) {
  constexpr Eigen::Index kFewestOthers = 12;  // views: three for each wave
  const Eigen::MatrixXd waves = waves_of(fields.frames, period);
  const Eigen::MatrixXd normal = waves.transpose() * waves, right = waves.transpose() * fields.rows;
  const auto breath_at = [&](Eigen::Index i) {
    return std::floor((fields.frames[static_cast<std::size_t>(i)] - fields.frames.front()) /
                      period);
  };
  Foretold sum;
  for (Eigen::Index first = 0, end = 0; first < waves.rows(); first = end) {
    while (end < waves.rows() && breath_at(end) == breath_at(first)) ++end;
    if (waves.rows() - (end - first) < kFewestOthers) continue;
    const Eigen::MatrixXd own = waves.middleRows(first, end - first),
                          seen = fields.rows.middleRows(first, end - first);
    const Eigen::MatrixXd by_others =
        fitted(normal - own.transpose() * own, right - own.transpose() * seen);
    sum.all += seen.squaredNorm();
    sum.left += (seen - own * by_others).squaredNorm();
  }
  return sum;
}

}  // namespace

double breath_period_frames(const std::vector<std::size_t>& view_frames, const Scene& scene) {
  constexpr std::size_t kFewestViews = 30;
  constexpr double kShortest_frames = 8, kViewsInABreath = 6, kFiner = 1.01;
  // One field that wanders at random, in 50 views, comes again by this share in 2 or 3 of a hundred
  // clips, more fields in none; in fewer breaths they do more often.
  constexpr double kForetold = 0.5, kFewestBreaths = 2.85;
  constexpr double kClearly = 0.1;  // twice a period is one, too
  const Fields fields = error_fields(view_frames, scene);
  const std::size_t views = fields.frames.size();
  if (views < kFewestViews) return 0;
  const double span = fields.frames.back() - fields.frames.front();
  double best = 0, most = 0;
  for (double period = std::max(kShortest_frames, kViewsInABreath * span / double(views));
       period * kFewestBreaths < span; period *= kFiner) {
    const double share = foretell(fields, period).share();
    if (share <= most + (best > 0 && period > 1.5 * best ? kClearly : 0)) continue;
    most = share;
    best = period;
  }
  return most > kForetold ? best : 0;
}

namespace {

// The longest tracks that have places, until every view has its share: they hold a breath as well
// as all do.
Scene longest_tracks(const Scene& scene) {
  constexpr std::size_t kPerView = 150;
  Scene part{scene.lens, scene.camera_from_world, {}};
  std::vector<const Landmark*> placed;
  for (const Landmark& landmark : scene.landmarks)
    if (landmark.place) placed.push_back(&landmark);
  std::ranges::stable_sort(placed, std::greater(),
                           [](const Landmark* one) { return one->seen.size(); });
  std::vector<std::size_t> taken(scene.camera_from_world.size());
  for (const Landmark* one : placed) {
    if (std::ranges::none_of(one->seen,
                             [&](const Sighting& seen) { return taken[seen.view] < kPerView; }))
      continue;
    for (const Sighting& seen : one->seen) ++taken[seen.view];
    part.landmarks.push_back(*one);
  }
  return part;
}

void measure_tissue(const Scene& scene, SolvedBreath& breath) {
  std::array<std::vector<double>, 3> along;
  std::vector<double> depths, away;
  for (const Landmark& landmark : scene.landmarks) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      along[axis].push_back((*landmark.place)[static_cast<Eigen::Index>(axis)]);
    for (const Sighting& seen : landmark.seen)
      if (seen.agrees && scene.is_posed(seen.view))
        depths.push_back((*scene.camera_from_world[seen.view] * *landmark.place).z());
  }
  for (std::size_t axis = 0; axis < 3; ++axis)
    breath.middle[static_cast<Eigen::Index>(axis)] = median(std::move(along[axis]));
  for (const Landmark& landmark : scene.landmarks)
    away.push_back((*landmark.place - breath.middle).norm());
  breath.reach = median(std::move(away));
  breath.depth = median(std::move(depths));
}

// The course that the fields have in common.
Breath::Waves common_waves(const Fields& fields, double period) {
  const Eigen::MatrixXd waves = waves_of(fields.frames, period);
  const Eigen::MatrixXd found = fitted(waves.transpose() * waves, waves.transpose() * fields.rows);
  return Eigen::JacobiSVD<Eigen::MatrixXd>(found, Eigen::ComputeThinU).matrixU().col(0);
}

void tell(const SolvedBreath& breath, Scene& scene) {
  scene.breath.resize(scene.camera_from_world.size());
  for (std::size_t view = 0; view < scene.breath.size(); ++view)
    scene.breath[view] = breath.course(breath.time_of(view));
  for (Landmark& landmark : scene.landmarks)
    if (landmark.place) landmark.push = breath.push(*landmark.place);
}

// Sightings that are left far off by the last step may come back by this one.
void refine(const FreeLens& lens, double robust_px, SolvedBreath& breath, Scene& scene) {
  constexpr double kStrays = 10;
  for (Landmark& landmark : scene.landmarks)
    if (landmark.place)
      for (Sighting& seen : landmark.seen)
        seen.agrees =
            scene.is_posed(seen.view) && scene.error_px(landmark, seen) <= kStrays * robust_px;
  adjust({.lens = lens, .tolerance = 1e-6, .robust_px = robust_px, .breath = &breath}, scene);
  tell(breath, scene);
  drop_outliers(scene);
  triangulate(scene);
}

// A breath rests where its course stays the longest: a quarter of the period that differs least.
void bring_to_rest(SolvedBreath& breath, Scene& scene) {
  constexpr std::size_t kSteps = 128;
  std::vector<double> heights;
  for (std::size_t i = 0; i < kSteps + kSteps / 4; ++i)
    heights.push_back(breath.course(breath.period_frames * double(i) / kSteps));
  double least = std::numeric_limits<double>::infinity(), rest = 0;
  for (auto first = heights.begin(); first != heights.begin() + kSteps; ++first) {
    const auto [low, high] = std::minmax_element(first, first + kSteps / 4);
    if (*high - *low >= least) continue;
    least = *high - *low;
    rest = 0.5 * (*low + *high);
  }
  const double most = *std::ranges::max_element(heights, {}, [&](double height) {
    return std::abs(height - rest);
  }) - rest;
  for (Landmark& landmark : scene.landmarks)
    if (landmark.place) *landmark.place += rest * landmark.push;
  breath.waves /= most;
  breath.rest = rest / most;
  breath.field *= most;
  tell(breath, scene);
}

}  // namespace

std::optional<Breath> solve_breath(const FreeLens& lens, double period_frames,
                                   const std::vector<std::size_t>& view_frames, Scene& scene) {
  constexpr double kExplained = 0.1;  // of what was foretold, as is left
  const Fields fields = error_fields(view_frames, scene);
  Scene part = longest_tracks(scene), whole = scene;
  SolvedBreath breath{view_frames};
  breath.period_frames = period_frames;
  breath.waves = common_waves(fields, period_frames);
  measure_tissue(part, breath);
  tell(breath, part);
  for (const double robust_px : {4, 2, 1}) refine(lens, robust_px, breath, part);
  // All others are placed by it: first by where the rigid scene had them, then by where they are.
  whole.camera_from_world = part.camera_from_world;
  whole.lens = part.lens;
  for (int i = 0; i < 2; ++i) {
    tell(breath, whole);
    for (Landmark& landmark : whole.landmarks) landmark.place.reset();
    triangulate(whole);
  }
  refine(lens, 1, breath, whole);
  bring_to_rest(breath, whole);
  const Foretold before = foretell(fields, period_frames),
                 after = foretell(error_fields(view_frames, whole), breath.period_frames);
  if (after.all - after.left > kExplained * (before.all - before.left)) return std::nullopt;
  scene = std::move(whole);
  return breath;
}

}  // namespace organbake
