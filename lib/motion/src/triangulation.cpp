// SPDX-License-Identifier: GPL-3.0-or-later
//
// Places of features. In: a scene with poses and sightings. A place is the point nearest to the
// rays of the two views that stand widest apart, then Gauss–Newton over the pixels of all that
// agree (Hartley & Sturm 1997). Places are then sought in views that should see them and do not,
// where the scope comes back. Out: places, and which sightings agree.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "organbake/core/parallel.h"
#include "organbake/motion/feature_tracker.h"
#include "organbake/motion/scene.h"
#include "two_views.h"

namespace organbake {
std::vector<std::size_t> Scene::posed() const {
  std::vector<std::size_t> views;
  for (std::size_t view = 0; view < camera_from_world.size(); ++view)
    if (is_posed(view)) views.push_back(view);
  return views;
}

Eigen::Vector3d Scene::place_in(std::size_t view, const Landmark& landmark) const {
  if (breath.empty()) return *landmark.place;
  return *landmark.place + breath[view] * landmark.push;
}

double Scene::error_px(const Landmark& landmark, const Sighting& sighting) const {
  const Eigen::Vector3d point =
      *camera_from_world[sighting.view] * place_in(sighting.view, landmark);
  if (!(point.z() > 0)) return std::numeric_limits<double>::infinity();
  return (project(lens, point) - sighting.pixel).norm();
}

double Scene::angle_rad(const Landmark& landmark) const {
  std::vector<Eigen::Vector3d> rays;
  for (const Sighting& sighting : landmark.seen)
    if (sighting.agrees && is_posed(sighting.view)) {
      const RigidTransform& pose = *camera_from_world[sighting.view];
      const Eigen::Vector3d point = pose * place_in(sighting.view, landmark);
      rays.push_back((pose.rotation.transpose() * point).normalized());
    }
  double smallest = 1;
  for (std::size_t i = 0; i < rays.size(); ++i)
    for (std::size_t j = i + 1; j < rays.size(); ++j)
      smallest = std::min(smallest, rays[i].dot(rays[j]));
  return std::acos(std::clamp(smallest, -1.0, 1.0));
}

std::vector<Landmark> landmarks_of(const ClipTracks& clip, const std::vector<std::size_t>& frames) {
  std::vector<Landmark> landmarks;
  for (std::size_t i = 0; i < clip.tracks.size(); ++i) {
    const FeatureTrack& track = clip.tracks[i];
    Landmark landmark{i, {}, {}};
    const auto first = std::lower_bound(frames.begin(), frames.end(), track.first_frame);
    for (auto at = first; at != frames.end() && *at < track.end_frame(); ++at)
      landmark.seen.push_back(
          {static_cast<std::size_t>(at - frames.begin()), track.at(*at).cast<double>()});
    if (landmark.seen.size() >= 2) landmarks.push_back(std::move(landmark));
  }
  return landmarks;
}

std::vector<std::size_t> seen_by_both(const std::vector<Landmark>& landmarks, std::size_t a,
                                      std::size_t b) {
  std::vector<std::size_t> both;
  for (std::size_t i = 0; i < landmarks.size(); ++i)
    if (sighting_in(landmarks[i], a) && sighting_in(landmarks[i], b)) both.push_back(i);
  return both;
}

const Sighting* sighting_in(const Landmark& landmark, std::size_t view) {
  const auto found = std::ranges::lower_bound(landmark.seen, view, {}, &Sighting::view);
  return found != landmark.seen.end() && found->view == view ? &*found : nullptr;
}

namespace {

constexpr double kLeastAngle_rad = 0.012;  // between two rays: 0.7 degrees
constexpr double kAgrees_px = 3;           // a sighting with its place

struct Ray {
  Eigen::Vector3d origin, direction;
};

// To the landmark's place at rest.
Ray ray_of(const Scene& scene, const Landmark& landmark, const Sighting& sighting) {
  const RigidTransform world_from_camera = scene.camera_from_world[sighting.view]->inverse();
  Eigen::Vector3d origin = world_from_camera.translation;
  if (!scene.breath.empty()) origin -= scene.breath[sighting.view] * landmark.push;
  return {origin,
          (world_from_camera.rotation * unproject(scene.lens, sighting.pixel)).normalized()};
}

Eigen::Vector3d nearest_to(const Ray& a, const Ray& b) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const Ray& ray : {a, b}) {
    const Eigen::Matrix3d across =
        Eigen::Matrix3d::Identity() - ray.direction * ray.direction.transpose();
    sum += across;
    right += across * ray.origin;
  }
  return sum.ldlt().solve(right);
}

void refine_place(const Scene& scene, Landmark& landmark) {
  constexpr int kSteps = 3;
  for (int step = 0; step < kSteps; ++step) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (const Sighting& sighting : landmark.seen) {
      if (!sighting.agrees || !scene.is_posed(sighting.view)) continue;
      const RigidTransform& pose = *scene.camera_from_world[sighting.view];
      const Eigen::Vector3d point = pose * scene.place_in(sighting.view, landmark);
      if (!(point.z() > 0)) return;
      const Eigen::Matrix<double, 2, 3> slopes = pixel_slopes(scene.lens, point) * pose.rotation;
      normal += slopes.transpose() * slopes;
      right += slopes.transpose() * (sighting.pixel - project(scene.lens, point));
    }
    const Eigen::Vector3d move = normal.ldlt().solve(right);
    if (!move.allFinite()) return;
    *landmark.place += move;
  }
}

std::size_t mark_agreeing(const Scene& scene, double most_error_px, Landmark& landmark) {
  std::size_t agreeing = 0;
  for (Sighting& sighting : landmark.seen) {
    if (!scene.is_posed(sighting.view)) continue;
    sighting.agrees = scene.error_px(landmark, sighting) <= most_error_px;
    agreeing += sighting.agrees;
  }
  return agreeing;
}

bool is_sound(const Scene& scene, Landmark& landmark) {
  return landmark.place->allFinite() && mark_agreeing(scene, kAgrees_px, landmark) >= 2 &&
         scene.angle_rad(landmark) >= kLeastAngle_rad;
}

void place_landmark(const Scene& scene, Landmark& landmark) {
  std::vector<Ray> rays;
  for (const Sighting& sighting : landmark.seen)
    if (scene.is_posed(sighting.view)) rays.push_back(ray_of(scene, landmark, sighting));
  // The two that stand widest apart tell the depth best, and err the most where one strays.
  double widest = std::cos(kLeastAngle_rad);
  const Ray *a = nullptr, *b = nullptr;
  for (std::size_t i = 0; i < rays.size(); ++i)
    for (std::size_t j = i + 1; j < rays.size(); ++j)
      if (const double cosine = rays[i].direction.dot(rays[j].direction); cosine < widest) {
        widest = cosine;
        a = &rays[i];
        b = &rays[j];
      }
  if (!a) return;
  landmark.place = nearest_to(*a, *b);
  // A place of two rays is rough yet: who is twice as far off as agrees may come back by all.
  if (mark_agreeing(scene, 2 * kAgrees_px, landmark) >= 2) refine_place(scene, landmark);
  if (!is_sound(scene, landmark)) landmark.place.reset();
}

}  // namespace

void triangulate(Scene& scene, std::optional<std::size_t> view) {
  parallel_each(std::size_t{0}, scene.landmarks.size(), std::size_t{256}, [&](std::size_t i) {
    Landmark& landmark = scene.landmarks[i];
    if (!landmark.place && (!view || sighting_in(landmark, *view))) place_landmark(scene, landmark);
  });
}

void drop_outliers(Scene& scene) {
  for (Landmark& landmark : scene.landmarks)
    if (landmark.place && !is_sound(scene, landmark)) landmark.place.reset();
}

void settle(const AdjustmentOptions& options, Scene& scene) {
  adjust(options, scene);
  drop_outliers(scene);
  triangulate(scene);
}

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
  const auto at = std::ranges::lower_bound(landmark.seen, view, {}, &Sighting::view);
  landmark.seen.insert(at, {view, pixel});
}

}  // namespace

void rejoin(const std::vector<const ClipPicture*>& views, Scene& scene) {
  std::vector<FlowPyramid> pyramids(views.size());
  std::vector<std::vector<Rejoined>> found(views.size());
  parallel_for(std::size_t{0}, views.size(), [&](std::size_t view) {
    if (views[view] && scene.is_posed(view))
      pyramids[view] = flow_pyramid(tracked_picture(views[view]->picture.color));
  });
  parallel_for(std::size_t{0}, views.size(), [&](std::size_t view) {
    if (views[view] && scene.is_posed(view))
      found[view] = find(views, pyramids, wanted_in(views, scene, view), view);
  });
  for (std::size_t view = 0; view < views.size(); ++view)
    for (const Rejoined& one : found[view])
      add_sighting(view, one.pixel, scene.landmarks[one.landmark]);
}

}  // namespace organbake
