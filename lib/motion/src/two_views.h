// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "organbake/bundle/breath.h"
#include "organbake/geometry/camera.h"
#include "organbake/motion/clip_motion.h"
#include "organbake/motion/scene.h"
#include "organbake/shading/grid.h"

namespace organbake {

// The pyramid of a tracked picture, as Lucas–Kanade reads it.
using FlowPyramid = std::vector<cv::Mat>;
FlowPyramid flow_pyramid(const Grid<std::uint8_t>& picture);

// Where points (pixels, the first one's centre at (0.5, 0.5)) of one picture are in another, by
// pyramidal Lucas–Kanade (Bouguet 2000); nothing for those that, tracked back, end more than
// `most_apart_px` from where they began. `guesses`: where they are about, one each; or empty.
std::vector<std::optional<Eigen::Vector2f>> follow_points(
    const FlowPyramid& from, const FlowPyramid& to, const std::vector<Eigen::Vector2f>& points,
    const std::vector<Eigen::Vector2f>& guesses, double most_apart_px);

// Whether the pixel that holds this point is there and not zero.
bool is_usable(const Mask& usable, const Eigen::Vector2f& point);

// What two views of one rigid scene tell of how the scope moved between them.
struct TwoViews {
  RigidTransform second_from_first;  // its translation has length 1
  std::size_t agreeing = 0;          // pairs that this motion explains, in front of both
  double median_angle_rad = 0;       // between their rays
  // How far (pixels, upper fifth) pairs lie from where the best plane, or pure turn, or zoom would
  // have them: without this parallax pictures tell no shape.
  double parallax_px = 0;
};

// `first` and `second`: pixels of the same features. The essential matrix by OpenCV's USAC
// (Barath et al., MAGSAC++ 2020; Nistér's five points), the better of its four motions; none
// agreeing when there are too few pairs. Deterministic.
TwoViews relate_views(const Intrinsics& lens, const std::vector<Eigen::Vector2d>& first,
                      const std::vector<Eigen::Vector2d>& second);

// How a pixel moves with its point (camera axes, z > 0) through any lens, by differences in the
// plane z = 1.
Eigen::Matrix<double, 2, 3> pixel_slopes(const Intrinsics& lens, const Eigen::Vector3d& point);

// Moves the scene (adjust), then asks anew which sightings agree and what has a place.
void settle(const AdjustmentOptions& options, Scene& scene);

// Of the features that three or more posed views see, the share of sightings that agrees.
double agreeing_share(const Scene& scene);

// Keeps the poses of the most views in a row over which features stay where the views before and
// after have them; elsewhere the scope has jumped, or tissue has moved. What is kept is fitted
// anew. Deterministic.
void keep_rigid_span(const FreeLens& lens, Scene& scene);

// Looks for places in views that do not see them yet but should, by where they are projected to:
// where the scope comes back, and where a track was lost. Each is tracked there from the view that
// saw it under the most similar direction and distance, and back again. New sightings agree until
// drop_outliers() says otherwise. `views`: the picture of each view, or null. Deterministic for any
// number of threads.
void rejoin(const std::vector<const ClipPicture*>& views, Scene& scene);

// How the brightness of places in one view goes with their range from a lamp at the lens, where
// their hue is alike. The inverse square alone gives a slope of -2; a scene that is inside out has
// what is near dark.
struct LampAgreement {
  static constexpr double kObjects = 0.3;  // correlation from which the lamp speaks against a scene

  double correlation = 0, slope = 0;  // of the logarithms
  // Of each place in one view and another, where only the distance changes.
  double correlation_over_time = 0;
  std::size_t sightings = 0;  // 0 = there are no pictures to tell by
};
LampAgreement lamp_agreement(const Scene& scene);

// Measures the light of the sightings that have none yet. `views`: the picture of each view, or
// null.
void measure_light(const std::vector<const ClipPicture*>& views, Scene& scene);

// Of two figures, by their variances and covariance; 0 where one of them is the same everywhere.
double correlation_in(const Eigen::Matrix2d& spread);

double focal_of_view(const Intrinsics& lens, double view_rad);
// By how many standard deviations a lens's focal length and distortion are unlike a scope's.
Eigen::Vector2d unlike_a_scope(const Intrinsics& lens);

struct BasinChoice {
  double runner_up = 0;  // what the next best scene of another shape costs by the best; 0 = none
  double focal_variance_px2 = 0;  // by those scenes, each as far as it is believed
};
// Gives the scene the lens and the poses of some views to begin with; of a scene that cannot be
// told it poses none. Deterministic for any number of threads.
BasinChoice choose_basin(const FreeLens& free, Scene& scene, const RunContext& context);

constexpr int kOfPose = 6, kOfLens = 2, kOfPlace = 3;  // unknowns

// A sighting's error and how it changes, weighed as the robust cost bends there (Triggs et al.
// 2000, 4.3): across the error by the weight alone, along it by less.
struct WeighedSighting {
  Eigen::Vector2d error;                                         // pixels
  Eigen::Matrix<double, 2, kOfPose, Eigen::RowMajor> by_pose;    // angle and axis, translation
  Eigen::Matrix<double, 2, kOfPlace, Eigen::RowMajor> by_place;  // of its landmark
  Eigen::Matrix<double, 2, kOfLens, Eigen::RowMajor> by_lens;    // focal length, k1

  // False for what lies behind its view. The view must have a pose, the landmark a place.
  bool weigh(const Sighting& seen, const Landmark& landmark, const FreeLens& free,
             const Scene& scene);
};

// By leaving out one region of the tissue after another (lens_doubt.cpp), and by the scenes
// that fit nearly as well.
LensSpread lens_spread(const FreeLens& free, const Scene& scene, double focal_variance_px2);

// By how many frames tissue comes and goes, as by breathing (breathing.cpp); 0 where none is told,
// as in fewer than three breaths.
double breath_period_frames(const std::vector<std::size_t>& view_frames, const Scene& scene);

// A breath's time, frames: from the clip's first view.
inline double breath_time(const std::vector<std::size_t>& view_frames, std::size_t frame) {
  return static_cast<double>(frame) - static_cast<double>(view_frames.front());
}

// A breath while it is solved for.
struct SolvedBreath : Breath {
  std::vector<std::size_t> view_frames;
  double depth = 1;  // of the tissue before the scope

  explicit SolvedBreath(const std::vector<std::size_t>& frames) : view_frames(frames) {}
  double time_of(std::size_t view) const { return breath_time(view_frames, view_frames[view]); }
};

// Tells a breath of this period, from the scope's own way, and moves the scene to its rest.
// Nothing, and nothing moved, where errors still come and go with it.
std::optional<Breath> solve_breath(const FreeLens& lens, double period_frames,
                                   const std::vector<std::size_t>& view_frames, Scene& scene);

// Failed where the lamp contradicts the scene; doubtful where something speaks against it.
MotionQuality judge_motion(const ClipMotion& motion, const LampAgreement& lamp, double runner_up,
                           bool lens_is_free);

}  // namespace organbake
