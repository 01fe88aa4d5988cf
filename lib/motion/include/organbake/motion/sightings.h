// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "organbake/geometry/camera.h"
#include "organbake/motion/clip_tracks.h"

namespace organbake {

// Where one feature is seen, in views that are counted from 0: the frames that are solved for.
struct Sighting {
  std::size_t view = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  bool agrees = true;  // with the point that was found
};

// A feature, and the point of the tissue that it shows, once that is found.
struct Landmark {
  std::size_t track = 0;       // of the clip
  std::vector<Sighting> seen;  // in the order of the views
  std::optional<Eigen::Vector3d> place;
};

// A rigid scene seen by one moving lens. The unit of length is the scene's own.
struct Scene {
  Intrinsics lens;
  std::vector<std::optional<RigidTransform>> camera_from_world;  // of each view, once it is posed
  std::vector<Landmark> landmarks;

  bool is_posed(std::size_t view) const { return camera_from_world[view].has_value(); }
  std::size_t posed_views() const;
  // Pixels between where a sighting is and where its landmark's place is projected to; infinite
  // behind the camera. Both must be known.
  double error_px(const Landmark& landmark, const Sighting& sighting) const;
  // The largest angle between two agreeing rays to a landmark that has a place.
  double angle_rad(const Landmark& landmark) const;
};

// The tracks that at least two of these frames (ascending) show. A frame's number in the list is
// its view.
std::vector<Landmark> landmarks_of(const ClipTracks& clip, const std::vector<std::size_t>& frames);

// Landmarks that both views see, as their numbers.
std::vector<std::size_t> seen_by_both(const std::vector<Landmark>& landmarks, std::size_t a,
                                      std::size_t b);
// Nothing where the view does not see it.
const Sighting* sighting_in(const Landmark& landmark, std::size_t view);

}  // namespace organbake
