// SPDX-License-Identifier: GPL-3.0-or-later
#include "rejoin.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "optical_flow.h"
#include "organbake/core/parallel.h"
#include "organbake/motion/tracked_picture.h"

namespace organbake {
namespace {

constexpr double kMostTurned_rad = 0.35;  // of the direction of view: a window still looks alike
constexpr double kMostZoomed = 0.22;      // |ln| of the distances' ratio, likewise
constexpr double kFarthest_px = 12;       // from where it is projected to
constexpr double kBackAgain_px = 0.5;
constexpr std::size_t kFewestTogether = 25;  // by chance a few are always found

struct Wanted {
  std::size_t landmark, from_view;
  Eigen::Vector2f from, guess;
};

struct Direction {
  Eigen::Vector3d towards;  // the camera, unit
  double distance = 0;
};

Direction direction_to(const Scene& scene, std::size_t view, const Eigen::Vector3d& place) {
  const RigidTransform& pose = *scene.camera_from_world[view];
  const Eigen::Vector3d away = pose.rotation.transpose() * (pose * place);
  return {away.normalized(), away.norm()};
}

// The agreeing sighting from which a window would look the most alike.
const Sighting* most_alike(const Scene& scene, const Landmark& landmark, std::size_t view) {
  const Direction here = direction_to(scene, view, *landmark.place);
  const Sighting* best = nullptr;
  double least = 1;
  for (const Sighting& sighting : landmark.seen) {
    if (!sighting.agrees || !scene.is_posed(sighting.view)) continue;
    const Direction there = direction_to(scene, sighting.view, *landmark.place);
    const double turned =
        std::acos(std::clamp(here.towards.dot(there.towards), -1.0, 1.0)) / kMostTurned_rad;
    const double zoomed = std::abs(std::log(here.distance / there.distance)) / kMostZoomed;
    const double unlike = std::max(turned, zoomed);
    if (unlike < least) {
      least = unlike;
      best = &sighting;
    }
  }
  return best;
}

std::vector<Wanted> wanted_in(const std::vector<const ClipPicture*>& views, const Scene& scene,
                              std::size_t view) {
  std::vector<Wanted> wanted;
  for (std::size_t i = 0; i < scene.landmarks.size(); ++i) {
    const Landmark& landmark = scene.landmarks[i];
    if (!landmark.place || sighting_in(landmark, view)) continue;
    const Eigen::Vector3d point = *scene.camera_from_world[view] * *landmark.place;
    if (!(point.z() > 0)) continue;
    const Eigen::Vector2f guess = project(scene.lens, point).cast<float>();
    if (!is_usable(views[view]->usable, guess)) continue;
    if (const Sighting* from = most_alike(scene, landmark, view))
      wanted.push_back({i, from->view, from->pixel.cast<float>(), guess});
  }
  return wanted;
}

struct Rejoined {
  std::size_t landmark;
  Eigen::Vector2d pixel;
};

std::vector<Rejoined> find(const std::vector<const ClipPicture*>& views,
                           const std::vector<FlowPyramid>& pyramids,
                           const std::vector<Wanted>& wanted, std::size_t view) {
  std::map<std::size_t, std::vector<const Wanted*>> by_view;
  for (const Wanted& one : wanted) by_view[one.from_view].push_back(&one);
  std::vector<Rejoined> all;
  for (const auto& [from_view, group] : by_view) {
    std::vector<Eigen::Vector2f> from, guesses;
    for (const Wanted* one : group) {
      from.push_back(one->from);
      guesses.push_back(one->guess);
    }
    const auto tracked =
        follow_points(pyramids[from_view], pyramids[view], from, guesses, kBackAgain_px);
    for (std::size_t i = 0; i < group.size(); ++i)
      if (tracked[i] && is_usable(views[view]->usable, *tracked[i]) &&
          (*tracked[i] - guesses[i]).norm() <= kFarthest_px)
        all.push_back({group[i]->landmark, tracked[i]->cast<double>()});
  }
  return all.size() >= kFewestTogether ? all : std::vector<Rejoined>();
}

void add_sighting(std::size_t view, const Eigen::Vector2d& pixel, Landmark& landmark) {
  const auto at = std::lower_bound(
      landmark.seen.begin(), landmark.seen.end(), view,
      [](const Sighting& sighting, std::size_t wanted) { return sighting.view < wanted; });
  landmark.seen.insert(at, {view, pixel, true});
}

}  // namespace

std::size_t rejoin(const std::vector<const ClipPicture*>& views, Scene& scene) {
  std::vector<FlowPyramid> pyramids(views.size());
  std::vector<std::vector<Rejoined>> found(views.size());
  parallel_for(std::size_t{0}, views.size(), [&](std::size_t view) {
    if (scene.is_posed(view))
      pyramids[view] = FlowPyramid(tracked_picture(views[view]->picture.color));
  });
  parallel_for(std::size_t{0}, views.size(), [&](std::size_t view) {
    if (scene.is_posed(view))
      found[view] = find(views, pyramids, wanted_in(views, scene, view), view);
  });
  std::size_t added = 0;
  for (std::size_t view = 0; view < views.size(); ++view)
    for (const Rejoined& one : found[view]) {
      add_sighting(view, one.pixel, scene.landmarks[one.landmark]);
      ++added;
    }
  return added;
}

}  // namespace organbake
