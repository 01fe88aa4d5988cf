// SPDX-License-Identifier: GPL-3.0-or-later
// Many starts round the given one, fitted on a coarse level and thinned from level to level: a
// piece of tissue has many poses that look a little alike.
#include "color/tissue_search.h"

#include <algorithm>

#include "appearance/appearance.h"
#include "color/tissue_colors.h"
#include "color/tissue_fit.h"
#include "organbake/core/median.h"
#include "organbake/core/parallel.h"
#include "organbake/core/random.h"

namespace organbake {
namespace {

constexpr int kFinestSide = 500;  // pixels: finer than this, texture drowns all but the outlines

// A tenth of what the start shows: darker pixels count less and less.
double darkness(const RegisteredSurface& surface, const PhotoLevel& level, const ObjectPose& pose) {
  constexpr double kShare = 0.1, kLeast = 0.004;
  const ShadingBasis basis({}, pose.center_camera_mm.norm());
  Prediction p;
  predict(surface, level, pose, 1, basis, basis.first_weights(), {}, p);
  std::vector<float> luminance;
  for (const WeightedPixel& pixel : overlap(level, p, 5))
    luminance.push_back(level.luminance[level.index(pixel.x, pixel.y)]);
  return std::max(kLeast, kShare * median(std::move(luminance)));
}

std::vector<ObjectPose> places_round(const ObjectPose& start) {
  constexpr int kPlaces = 24;
  constexpr double kTurn_rad = 0.12, kShift_mm = 7;
  RandomStream random(20040902);
  std::vector<ObjectPose> places = {start};
  for (int i = 0; i < kPlaces; ++i) {
    Motion motion;
    for (int j = 0; j < 6; ++j) motion[j] = random.normal();
    motion.head<3>() *= kTurn_rad / motion.head<3>().norm();
    motion.tail<3>() *= kShift_mm / motion.tail<3>().norm();
    places.push_back(moved(start, motion));
  }
  return places;
}

bool apart(const ObjectPose& a, const ObjectPose& b) {
  constexpr double kTurn_rad = 0.03, kShift_mm = 2;
  const Motion motion = motion_between(a, b);
  return motion.head<3>().norm() > kTurn_rad || motion.tail<3>().norm() > kShift_mm;
}

// Less of a surface is easily explained: what has slid out of the picture is no match.
void drop_those_that_show_little(std::vector<TissueFit>& fits) {
  constexpr double kLeastShare = 0.6;  // of what the others show
  std::erase_if(fits, [](const TissueFit& fit) { return !fit.usable; });
  std::vector<double> shown;
  for (const TissueFit& fit : fits) shown.push_back(fit.pixels);
  const double least = kLeastShare * median(std::move(shown));
  std::erase_if(fits, [&](const TissueFit& fit) { return fit.pixels < least; });
}

// The likeliest of those that are apart, best first.
std::vector<TissueFit> likeliest(std::vector<TissueFit> fits, std::size_t count) {
  drop_those_that_show_little(fits);
  std::stable_sort(fits.begin(), fits.end(),
                   [](const TissueFit& a, const TissueFit& b) { return a.cost < b.cost; });
  std::vector<TissueFit> best;
  for (const TissueFit& fit : fits) {
    if (best.size() == count) break;
    const bool is_new = std::all_of(best.begin(), best.end(), [&](const TissueFit& known) {
      return apart(known.pose, fit.pose);
    });
    if (is_new) best.push_back(fit);
  }
  return best;
}

struct Stage {
  int level, steps;
  std::size_t kept;  // of the fits, for the next one
};

std::vector<Stage> stages(const std::vector<PhotoLevel>& pyramid) {
  const int coarsest = static_cast<int>(pyramid.size()) - 1;
  std::vector<Stage> all = {{coarsest, 6, 12}, {coarsest, 10, 4}};
  for (int i = coarsest - 1; i >= 0; --i) {
    const Intrinsics& lens = pyramid[i].intrinsics;
    if (std::max(lens.width, lens.height) > kFinestSide) break;
    all.push_back({i, i + 1 == coarsest ? 10 : 5, 1});
  }
  return all;
}

}  // namespace

std::optional<ObjectPose> search_tissue(const RegisteredSurface& surface, const Rgb8Image& photo,
                                        const std::vector<PhotoLevel>& pyramid,
                                        const ObjectPose& start, const RunContext& context) {
  const int coarsest = static_cast<int>(pyramid.size()) - 1;
  const double dark = darkness(surface, pyramid[coarsest], start);
  std::vector<TissueFit> fits;
  for (const ObjectPose& place : places_round(start)) fits.push_back({.pose = place});
  for (const Stage& stage : stages(pyramid)) {
    const PhotoLevel& level = pyramid[stage.level];
    const TissueLevel tissue{level, log_hues(photo, level), dark};
    parallel_for(std::size_t{0}, fits.size(), [&](std::size_t i) {
      context.throw_if_cancelled();
      climb_tissue(surface, tissue, start, stage.steps, fits[i]);
    });
    fits = likeliest(std::move(fits), stage.kept);
    if (fits.empty()) return std::nullopt;
  }
  return fits.front().pose;
}

}  // namespace organbake
