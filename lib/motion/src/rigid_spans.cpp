// SPDX-License-Identifier: GPL-3.0-or-later
//
// Which views of a scene are one rigid scene. In: a scene of all views. Either end of the clip, in
// several lengths, is fitted by itself; where it then explains clearly more of what its views see
// than together with the rest, the scope has jumped or tissue has moved. Out: the scene of the rest
// alone, without the views of the transition.
#include <algorithm>
#include <array>

#include "organbake/core/parallel.h"
#include "organbake/core/quantile.h"
#include "organbake/motion/clip_motion.h"
#include "organbake/motion/scene.h"
#include "two_views.h"

namespace organbake {
double agreeing_share(const Scene& scene, const ViewRange& range) {
  double all = 0, agreeing = 0;
  constexpr std::ptrdiff_t kFewest = 3;
  for (const Landmark& landmark : scene.landmarks) {
    const auto in_range = [&](const Sighting& seen) {
      return range.has(seen.view) && scene.is_posed(seen.view);
    };
    const auto seen = std::count_if(landmark.seen.begin(), landmark.seen.end(), in_range);
    if (seen < kFewest) continue;
    all += static_cast<double>(seen);
    if (landmark.place)
      agreeing += static_cast<double>(
          std::count_if(landmark.seen.begin(), landmark.seen.end(),
                        [&](const Sighting& one) { return one.agrees && in_range(one); }));
  }
  return all > 0 ? agreeing / all : 0;
}

namespace {

// Of the features that are seen well on both sides of a view, the share that has one place there.
double tied_share(const Scene& scene, std::size_t view) {
  constexpr int kWell = 2;  // sightings
  double both = 0, tied = 0;
  for (const Landmark& landmark : scene.landmarks) {
    std::array<int, 2> seen = {}, agreeing = {};
    for (const Sighting& one : landmark.seen) {
      if (!scene.is_posed(one.view)) continue;
      ++seen[one.view >= view];
      agreeing[one.view >= view] += landmark.place && one.agrees;
    }
    both += seen[0] >= kWell && seen[1] >= kWell;
    tied += agreeing[0] >= kWell && agreeing[1] >= kWell;
  }
  return both > 0 ? tied / both : 0;
}

// These views by themselves, with places of their own.
Scene alone(const Scene& scene, const ViewRange& range) {
  Scene part = scene;
  for (std::size_t view = 0; view < part.camera_from_world.size(); ++view)
    if (!range.has(view)) part.camera_from_world[view].reset();
  for (Landmark& landmark : part.landmarks) {
    landmark.place.reset();
    for (Sighting& seen : landmark.seen) seen.agrees = true;
  }
  triangulate(part);
  settle({.iterations = 10, .tolerance = 1e-4, .sightings_per_view = 100}, part);
  return part;
}

// The views of one end of the clip, so many of them, and those of them next to the rest.
struct ClipEnd {
  ViewRange views, border;
};

ClipEnd end_of(std::size_t views, std::size_t count, bool last) {
  constexpr std::size_t kBorder = 6;
  const std::size_t border = std::min(kBorder, count);
  if (last) return {{views - count, views}, {views - count, views - count + border}};
  return {{0, count}, {count - border, count}};
}

// Whether these views agree clearly better by themselves.
bool breaks_off(const Scene& scene, const ClipEnd& end) {
  constexpr double kTied = 0.75;  // of a scene that holds, nearly all features are
  // Of the sightings: a rigid scene's parts gain up to 0.02 by themselves, those of tissue that
  // breathes a little 0.1, though all of its path is right.
  constexpr double kClearly = 0.14;
  const std::size_t border = end.views.first == 0 ? end.views.end : end.views.first;
  if (tied_share(scene, border) > kTied) return false;
  return agreeing_share(alone(scene, end.views), end.border) >
         agreeing_share(scene, end.border) + kClearly;
}

// The most views of one end that break off; 0 = none do.
std::size_t broken_off(const Scene& scene, std::size_t fewest_views, bool last) {
  constexpr std::size_t kTries = 5;
  const std::size_t views = scene.camera_from_world.size(), most = views / 2;
  if (most < fewest_views) return 0;
  const std::size_t step = std::max<std::size_t>(1, (most - fewest_views) / kTries);
  std::vector<std::size_t> counts;
  for (std::size_t count = fewest_views; count <= most; count += step) counts.push_back(count);
  std::vector<char> broken(counts.size());
  parallel_for(std::size_t{0}, counts.size(), [&](std::size_t i) {
    broken[i] = breaks_off(scene, end_of(views, counts[i], last));
  });
  const auto farthest = std::find(broken.rbegin(), broken.rend(), 1);
  if (farthest == broken.rend()) return 0;
  std::size_t count = counts[static_cast<std::size_t>(broken.rend() - farthest) - 1];
  for (std::size_t i = 1; i < step && count + 1 <= most; ++i, ++count)
    if (!breaks_off(scene, end_of(views, count + 1, last))) break;
  return count;
}

void fit_anew(const FreeLens& lens, Scene& scene) {
  drop_outliers(scene);
  triangulate(scene);
  settle({.lens = lens, .iterations = 20, .tolerance = 1e-3, .sightings_per_view = 250}, scene);
}

// While the scope jumps or tissue moves, views fit neither side of a break.
void drop_transition(bool last, Scene& scene) {
  constexpr double kUsual = 0.9;  // of what the views agree
  std::vector<std::size_t> posed;
  std::vector<double> shares;
  for (std::size_t view = 0; view < scene.camera_from_world.size(); ++view) {
    if (!scene.is_posed(view)) continue;
    std::size_t seen = 0, agreeing = 0;
    for (const Landmark& landmark : scene.landmarks)
      if (const Sighting* one = sighting_in(landmark, view)) {
        ++seen;
        agreeing += landmark.place && one->agrees;
      }
    posed.push_back(view);
    shares.push_back(static_cast<double>(agreeing) / std::max<double>(1, double(seen)));
  }
  const double least = kUsual * median(shares);
  if (last) {
    std::reverse(posed.begin(), posed.end());
    std::reverse(shares.begin(), shares.end());
  }
  const std::size_t most = posed.size() / 4;
  for (std::size_t i = 0; i < most && shares[i] < least; ++i)
    scene.camera_from_world[posed[i]].reset();
}

}  // namespace

void keep_rigid_span(const FreeLens& lens, std::size_t fewest_views, Scene& scene) {
  std::vector<bool> broken;  // ends: whether it is the last one
  for (const bool last : {true, false}) {
    const std::size_t count = broken_off(scene, fewest_views, last);
    if (count == 0) continue;
    broken.push_back(last);
    const ViewRange gone = end_of(scene.camera_from_world.size(), count, last).views;
    for (std::size_t view = gone.first; view < gone.end; ++view)
      scene.camera_from_world[view].reset();
    fit_anew(lens, scene);
  }
  if (broken.empty()) return;
  // What is usual is told by the rest alone.
  for (const bool last : broken) drop_transition(last, scene);
  fit_anew(lens, scene);
  adjust({.lens = lens, .iterations = 20}, scene);
  drop_outliers(scene);
}

}  // namespace organbake
