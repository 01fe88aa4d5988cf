// SPDX-License-Identifier: GPL-3.0-or-later
//
// The part of a clip that one rigid scene explains. In: a scene whose views are posed. Halves of
// the tissue each tell the scope's path anew; how far their paths lie from the whole tissue's is
// its standard error (balanced half-samples, McCarthy 1969). Where tissue moves against other
// tissue, or views hang together by too little, halves part. Out: the scene without the views whose
// places they don't tell, and how sure the rest is.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "organbake/core/parallel.h"
#include "organbake/core/quantile.h"
#include "organbake/motion/scene.h"
#include "two_views.h"

namespace organbake {
namespace {

using Centers = std::vector<std::optional<Eigen::Vector3d>>;  // of the lens, by view

// The path as these landmarks alone tell it; nothing of views that see too few of them.
Centers path_by(const std::vector<std::size_t>& landmarks, const Scene& scene) {
  constexpr std::size_t kFewest = 30;
  Scene part{scene.lens, scene.camera_from_world, {}};
  for (const std::size_t i : landmarks) part.landmarks.push_back(scene.landmarks[i]);
  adjust({.iterations = 15, .tolerance = 1e-6, .sightings_per_view = 300}, part);
  const std::size_t views = scene.camera_from_world.size();
  std::vector<SeenPlaces> seen(views);
  std::vector<std::size_t> agreeing(views);
  for (const Landmark& landmark : part.landmarks)
    for (const Sighting& one : landmark.seen) {
      seen[one.view].places.push_back(*landmark.place);
      seen[one.view].pixels.push_back(one.pixel);
      agreeing[one.view] += one.agrees;
    }
  Centers centers(views);
  for (std::size_t view = 0; view < views; ++view) {
    if (!scene.is_posed(view) || seen[view].places.size() < kFewest) continue;
    RigidTransform pose = *part.camera_from_world[view];
    // Of tissue that has moved nothing agrees with the rest: it tells where the view is to it.
    if (2 * agreeing[view] < seen[view].places.size()) adjust_pose(scene.lens, seen[view], pose);
    centers[view] = pose.inverse().translation;
  }
  return centers;
}

// Four regions of the tissue, two by two: what one half lacks another has.
std::vector<Centers> paths_by_halves(const Scene& scene) {
  const std::vector<std::vector<std::size_t>> regions = regions_of(scene, 2);
  constexpr std::size_t kHalves[][2] = {{0, 1}, {2, 3}, {0, 2}, {1, 3}, {0, 3}, {1, 2}};
  std::vector<Centers> paths(std::size(kHalves));
  parallel_for(std::size_t{0}, paths.size(), [&](std::size_t i) {
    std::vector<std::size_t> half = regions[kHalves[i][0]];
    const auto& other = regions[kHalves[i][1]];
    half.insert(half.end(), other.begin(), other.end());
    paths[i] = path_by(half, scene);
  });
  return paths;
}

// The views' standard errors as shares of the path's extent, where all paths are laid over each
// other by the views that are kept.
std::vector<double> errors_of(const Centers& whole, const std::vector<Centers>& halves,
                              const std::vector<bool>& kept) {
  const std::size_t views = whole.size();
  std::vector<Eigen::Vector2d> sums(views, Eigen::Vector2d::Zero());  // of squares; of halves
  Eigen::AlignedBox3d path;
  for (std::size_t view = 0; view < views; ++view)
    if (kept[view]) path.extend(*whole[view]);
  for (const Centers& half : halves) {
    Eigen::Matrix3Xd from(3, views), to(3, views);
    Eigen::Index count = 0;
    for (std::size_t view = 0; view < views; ++view)
      if (kept[view] && half[view]) {
        from.col(count) = *half[view];
        to.col(count++) = *whole[view];
      }
    if (count < 3) continue;
    const Eigen::Matrix4d laid = Eigen::umeyama(from.leftCols(count), to.leftCols(count), true);
    for (std::size_t view = 0; view < views; ++view)
      if (half[view])
        sums[view] += Eigen::Vector2d(
            ((laid * half[view]->homogeneous()).head<3>() - *whole[view]).squaredNorm(), 1);
  }
  std::vector<double> errors;
  for (const Eigen::Vector2d& sum : sums)
    errors.push_back(std::sqrt(sum[0] / std::max(1.0, sum[1])) / path.sizes().norm());
  return errors;
}

double median_where(const std::vector<bool>& counts, const std::vector<double>& values) {
  std::vector<double> counted;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (counts[i]) counted.push_back(values[i]);
  return median(std::move(counted));
}

constexpr double kUnlike = 2;  // times what is usual of the clip's own views

// A break lies where errors begin to be unlike the others, not where they have grown; and a view or
// two by themselves are chance.
void leave_out_runs(double unlike, const std::vector<bool>& posed,
                    const std::vector<double>& errors, std::vector<bool>& kept) {
  constexpr std::size_t kFewest = 3;
  std::vector<std::size_t> run;
  bool breaks = false;
  const auto end_run = [&] {
    for (const std::size_t view : run) kept[view] = !breaks || run.size() < kFewest;
    run.clear();
    breaks = false;
  };
  for (std::size_t view = 0; view < posed.size(); ++view) {
    if (!posed[view]) continue;
    if (errors[view] > unlike) {
      run.push_back(view);
      breaks = breaks || !kept[view];
    } else {
      kept[view] = true;
      end_run();
    }
  }
  end_run();
}

}  // namespace

double keep_rigid_span(const FreeLens& lens, Scene& scene) {
  constexpr std::size_t kFewest = 4;  // paths of fewer views can't be laid over each other
  if (scene.posed_views() < kFewest) return 0;
  const std::size_t views = scene.camera_from_world.size();
  std::vector<bool> posed(views);
  Centers whole(views);
  for (std::size_t view = 0; view < views; ++view)
    if ((posed[view] = scene.is_posed(view)))
      whole[view] = scene.camera_from_world[view]->inverse().translation;
  const std::vector<Centers> halves = paths_by_halves(scene);
  // Laid by the half of the views that agrees best (least trimmed squares, Rousseeuw 1984), then by
  // all that are like it.
  constexpr int kLayings = 12;
  std::vector<bool> kept = posed;
  std::vector<double> errors;
  for (int pass = 0; pass < kLayings; ++pass) {
    errors = errors_of(whole, halves, kept);
    const double most = 2 * pass < kLayings
                            ? median_where(posed, errors)
                            : std::max(kPathSure, kUnlike * median_where(kept, errors));
    for (std::size_t view = 0; view < views; ++view)
      kept[view] = posed[view] && errors[view] <= most;
  }
  errors = errors_of(whole, halves, kept);
  leave_out_runs(kUnlike * median_where(kept, errors), posed, errors, kept);
  double squares = 0;
  for (std::size_t view = 0; view < views; ++view)
    if (kept[view]) squares += errors[view] * errors[view];
  const auto count = static_cast<double>(std::count(kept.begin(), kept.end(), true));
  const double spread = std::sqrt(squares / std::max(1.0, count));
  if (kept == posed) return spread;
  for (std::size_t view = 0; view < views; ++view)
    if (!kept[view]) scene.camera_from_world[view].reset();
  drop_outliers(scene);
  settle({.lens = lens, .iterations = 20, .tolerance = 1e-3, .sightings_per_view = 250}, scene);
  adjust({.lens = lens, .iterations = 20}, scene);
  drop_outliers(scene);
  return spread;
}

}  // namespace organbake
