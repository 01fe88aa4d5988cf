// SPDX-License-Identifier: GPL-3.0-or-later
//
// Which views of a scene are one rigid scene. In: a scene of all views. Where the scope jumps or
// tissue moves, sightings that no longer fit are dropped, and features found after it get places of
// their own: what is left agrees, whatever its path. So each place of the clip is judged by what
// crosses it: features placed by the views of one side alone must be where the poses of the next
// views have them. Out: the scene of the longest part without a break.
#include <algorithm>

#include "organbake/core/parallel.h"
#include "organbake/core/quantile.h"
#include "organbake/motion/scene.h"
#include "two_views.h"

namespace organbake {
double agreeing_share(const Scene& scene) {
  double all = 0, agreeing = 0;
  constexpr std::ptrdiff_t kFewest = 3;
  for (const Landmark& landmark : scene.landmarks) {
    const auto is_posed = [&](const Sighting& seen) { return scene.is_posed(seen.view); };
    const auto seen = std::ranges::count_if(landmark.seen, is_posed);
    if (seen < kFewest) continue;
    all += static_cast<double>(seen);
    if (landmark.place)
      agreeing += static_cast<double>(std::ranges::count_if(
          landmark.seen, [&](const Sighting& one) { return one.agrees && is_posed(one); }));
  }
  return all > 0 ? agreeing / all : 0;
}

namespace {

using Views = std::vector<std::size_t>;

// Features that some views place well by themselves and one of the others sees, too; of the views
// these alone have a pose.
Scene placed_by(const Views& own, const Views& others, const Scene& scene) {
  constexpr std::size_t kMost = 400;  // features tell a share as well as thousands
  constexpr std::ptrdiff_t kFewestSightings = 3;
  constexpr double kSureAngle_rad = 0.035;
  Scene part{scene.lens, {}, {}, scene.breath};
  part.camera_from_world.resize(scene.camera_from_world.size());
  for (const std::size_t view : own) part.camera_from_world[view] = scene.camera_from_world[view];
  const auto is_own = [&](const Sighting& seen) { return part.is_posed(seen.view); };
  std::vector<const Landmark*> crossing;
  for (const Landmark& landmark : scene.landmarks)
    if (std::ranges::any_of(others, [&](auto view) { return sighting_in(landmark, view); }) &&
        std::ranges::count_if(landmark.seen, is_own) >= kFewestSightings)
      crossing.push_back(&landmark);
  for (std::size_t i = 0; i < crossing.size(); i += crossing.size() / kMost + 1) {
    part.landmarks.push_back({crossing[i]->track, crossing[i]->seen, {}, crossing[i]->push});
    for (Sighting& seen : part.landmarks.back().seen) seen.agrees = true;
  }
  triangulate(part);
  std::erase_if(part.landmarks, [&](const Landmark& landmark) {
    const auto agreeing = std::ranges::count_if(
        landmark.seen, [&](const Sighting& seen) { return is_own(seen) && seen.agrees; });
    return !landmark.place || agreeing < kFewestSightings ||
           3 * agreeing < 2 * std::ranges::count_if(landmark.seen, is_own) ||
           part.angle_rad(landmark) < kSureAngle_rad;
  });
  return part;
}

// Of the features that some views place, the share that each of the others sees there; the median.
// 1 where nothing tells.
double share_kept(const Views& own, const Views& others, const Scene& scene) {
  constexpr double kFewestFeatures = 30, kThere_px = 4;
  Scene part = placed_by(own, others, scene);
  std::vector<double> shares;
  for (const std::size_t view : others) {
    part.camera_from_world[view] = scene.camera_from_world[view];
    double seen = 0, there = 0;
    for (const Landmark& landmark : part.landmarks)
      if (const Sighting* one = sighting_in(landmark, view)) {
        ++seen;
        there += part.error_px(landmark, *one) <= kThere_px;
      }
    if (seen >= kFewestFeatures) shares.push_back(there / seen);
  }
  return shares.empty() ? 1 : median(std::move(shares));
}

// By view, but for the first: what is kept from the views before it to it and the next, or from
// those on to the ones before, whichever is less.
std::vector<double> shares_across(const Views& posed, const Scene& scene) {
  constexpr std::ptrdiff_t kOwn = 20, kOthers = 3;
  std::vector<double> shares(posed.size() - 1);
  parallel_for(std::size_t{0}, shares.size(), [&](std::size_t i) {
    const auto place = posed.begin() + static_cast<std::ptrdiff_t>(i) + 1;
    const auto before = [&](std::ptrdiff_t most) {
      return Views(place - std::min(most, place - posed.begin()), place);
    };
    const auto after = [&](std::ptrdiff_t most) {
      return Views(place, place + std::min(most, posed.end() - place));
    };
    shares[i] = std::min(share_kept(before(kOwn), after(kOthers), scene),
                         share_kept(after(kOwn), before(kOthers), scene));
  });
  return shares;
}

// The most views in a row that no break parts.
Views longest_unbroken(const Views& posed, const Scene& scene) {
  // Of what is usual in the clip. Rigid scenes keep 0.95 of it and more everywhere, tissue that
  // breathes 0.8; where a lobe is pushed aside or the poses lose their way, 0.6 and less is left.
  constexpr double kBroken = 0.7;
  const std::vector<double> shares = shares_across(posed, scene);
  const double least = kBroken * median(std::vector<double>(shares));
  Views longest, part = {posed.front()};
  for (std::size_t i = 1; i < posed.size(); ++i) {
    if (shares[i - 1] < least) {
      if (part.size() > longest.size()) longest = part;
      part.clear();
    }
    part.push_back(posed[i]);
  }
  return part.size() > longest.size() ? part : longest;
}

// Fits the scene anew to these of its views alone.
void keep_only(const Views& kept, const FreeLens& lens, Scene& scene) {
  for (const std::size_t view : scene.posed())
    if (!std::ranges::binary_search(kept, view)) scene.camera_from_world[view].reset();
  drop_outliers(scene);
  triangulate(scene);
  settle({.lens = lens, .iterations = 20, .tolerance = 1e-3, .sightings_per_view = 250}, scene);
  adjust({.lens = lens, .iterations = 20}, scene);
  drop_outliers(scene);
}

}  // namespace

void keep_rigid_span(const FreeLens& lens, Scene& scene) {
  const Views all = scene.posed();
  Views kept = all;
  while (kept.size() > 1) {
    Views unbroken = longest_unbroken(kept, scene);
    if (unbroken.size() == kept.size()) break;
    keep_only(unbroken, lens, scene);
    kept = scene.posed();
  }
  // Of a lobe that has just begun to move not enough is told yet: it takes the view beside a break
  // along.
  const std::size_t before = kept.size();
  if (before > 2 && kept.back() != all.back()) kept.pop_back();
  if (before > 2 && kept.front() != all.front()) kept.erase(kept.begin());
  if (kept.size() < before) keep_only(kept, lens, scene);
}

}  // namespace organbake
