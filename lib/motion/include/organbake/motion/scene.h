// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "organbake/geometry/camera.h"
#include "organbake/motion/feature_tracker.h"

namespace organbake {

// Where one feature is seen, in views that are counted from 0: the frames that are solved for.
struct Sighting {
  std::size_t view = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  bool agrees = true;  // with the point that was found
  // Linear red and green round it (measure_light); 0 where it is burnt out, black or not known.
  Eigen::Vector2d light = Eigen::Vector2d::Zero();
};

// A feature, and the point of the tissue that it shows, once that is found.
struct Landmark {
  std::size_t track = 0;       // of the clip
  std::vector<Sighting> seen;  // in the order of the views
  std::optional<Eigen::Vector3d> place;
  Eigen::Vector3d push = Eigen::Vector3d::Zero();  // what the most of a breath adds to it
};

// A scene seen by one moving lens, rigid but for what a breath moves. The unit of length is the
// scene's own.
struct Scene {
  Intrinsics lens;
  std::vector<std::optional<RigidTransform>> camera_from_world;  // of each view, once it is posed
  std::vector<Landmark> landmarks;
  // How far a breath has come in each view: 0 at rest, 1 at its most; empty = nothing breathes.
  std::vector<double> breath = {};

  bool is_posed(std::size_t view) const { return camera_from_world[view].has_value(); }
  std::vector<std::size_t> posed() const;  // the views that are, in their order
  std::size_t posed_views() const { return posed().size(); }
  // Where a landmark that has a place is while a view sees it.
  Eigen::Vector3d place_in(std::size_t view, const Landmark& landmark) const;
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

// Gives a place to each landmark without one that two posed views see under a wide enough angle,
// and says which of its sightings agree. Places are the point nearest to the rays of the two views
// that stand widest apart, then Gauss–Newton over the pixels of all that agree. With `view`, of
// the landmarks that this view sees.
void triangulate(Scene& scene, std::optional<std::size_t> view = std::nullopt);

// Sightings farther off do not agree (others do again), and landmarks of which fewer than two
// agree, or under too small an angle, lose their place.
void drop_outliers(Scene& scene);

// What of the lens is moved with the poses and points. Both focal lengths keep their ratio.
struct FreeLens {
  bool focal = false;
  bool distortion = false;  // k1 alone
};

struct SolvedBreath;

struct AdjustmentOptions {
  FreeLens lens = {};
  int iterations = 20;      // at most
  double tolerance = 1e-5;  // of the cost's change from one to the next
  // Of each view at most about so many sightings are taken, those of the longest tracks first; 0 =
  // all. A few hundred hold a pose as well as thousands, in a fraction of the time.
  std::size_t sightings_per_view = 0;
  // Views that are moved; empty = all. Points that they see are moved with them.
  std::vector<bool> moving = {};
  double robust_px = 1;            // an error beyond counts less (Cauchy)
  SolvedBreath* breath = nullptr;  // moved, too
};

// Moves poses, places and lens together until the sightings that agree lie where the places are
// seen (bundle adjustment, Triggs et al. 2000; Ceres' sparse Schur complement). The first posed
// view of those that move stays where it is, and the scene keeps its size where no lens or pose
// fixes it. Deterministic: one thread, sums in one order.
void adjust(const AdjustmentOptions& options, Scene& scene);

// Places that one view sees, and where.
struct SeenPlaces {
  std::vector<Eigen::Vector3d> places;
  std::vector<Eigen::Vector2d> pixels;
};

// Moves one view alone against places that are known. Returns how many agree to four pixels
// afterwards.
std::size_t adjust_pose(const Intrinsics& lens, const SeenPlaces& seen,
                        RigidTransform& camera_from_world);

}  // namespace organbake
