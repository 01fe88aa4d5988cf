// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/motion/sightings.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace organbake {

std::size_t Scene::posed_views() const {
  return static_cast<std::size_t>(std::count_if(camera_from_world.begin(), camera_from_world.end(),
                                                [](const auto& pose) { return pose.has_value(); }));
}

double Scene::error_px(const Landmark& landmark, const Sighting& sighting) const {
  const Eigen::Vector3d point = *camera_from_world[sighting.view] * *landmark.place;
  if (!(point.z() > 0)) return std::numeric_limits<double>::infinity();
  return (project(lens, point) - sighting.pixel).norm();
}

double Scene::angle_rad(const Landmark& landmark) const {
  std::vector<Eigen::Vector3d> rays;
  for (const Sighting& sighting : landmark.seen)
    if (sighting.agrees && is_posed(sighting.view)) {
      const RigidTransform& pose = *camera_from_world[sighting.view];
      rays.push_back((pose.rotation.transpose() * (pose * *landmark.place)).normalized());
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
  const auto found = std::lower_bound(
      landmark.seen.begin(), landmark.seen.end(), view,
      [](const Sighting& sighting, std::size_t wanted) { return sighting.view < wanted; });
  return found != landmark.seen.end() && found->view == view ? &*found : nullptr;
}

}  // namespace organbake
