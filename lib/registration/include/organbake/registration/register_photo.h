// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/geometry/camera.h"
#include "organbake/image/channel_image.h"
#include "organbake/registration/registered_surface.h"

namespace organbake {

// What of the pictures is correlated.
enum class Similarity {
  radiance,    // the paper's NCC, patch by patch
  silhouette,  // of the surface's cover with what has the organ's colours; needs a start
};

// What lights the organ in a photograph. Lambertian; gain and offset are NCC's own.
enum class LightModel {
  automatic,  // one of those below, by what the photograph tells
  camera,     // at the camera's centre: cos θ / r²
  beam,       // near the lens; place, fall-off and beam or vignette are estimated with the pose
  estimated,  // unknown and far, estimated with the pose
};
const char* name_of(LightModel model);

// What is known of the distance of things in a photograph, of the organ and of others: points about
// evenly spread over the view, each the mean of what its neighbourhood shows.
struct SeenDepth {
  struct Point {
    Eigen::Vector3d place = Eigen::Vector3d::Zero();  // camera axes of the photograph
    // Of what is seen there, towards the camera; zero where too few neighbours tell it.
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    double trust = 1;         // 0…1
    int column = 0, row = 0;  // of the neighbourhood in the view's grid
  };
  std::vector<Point> points;
  int columns = 0, rows = 0;
  bool relative = false;  // places are in a unit of their own; else mm

  bool empty() const { return points.empty(); }
};

// Thins points that are seen from the camera's centre, in its axes, to some 1,500 neighbourhoods of
// the view; points that are not before the camera or not finite count as none, and neighbourhoods
// of few points or with a step of depth are left out. `trust` (0…1) has one number a point, or
// none.
SeenDepth thin_depth(const std::vector<Eigen::Vector3d>& points, const std::vector<float>& trust,
                     bool relative);

// How far from a start the pose is looked for.
enum class SearchRange {
  wide,       // tens of millimetres and degrees
  one_frame,  // as far as a clip moves from one frame to the next; the lens is not doubted
};

struct RegistrationOptions {
  LightModel light = LightModel::automatic;
  Similarity similarity = Similarity::radiance;
  bool free_focal = false;  // one scale for both focal lengths is sought with the pose
  SearchRange range = SearchRange::wide;
  // Where a pose is not ok, follow the lights that were not chosen, and look for its colours: what
  // comes of it is doubtful at best, and takes as long again.
  bool fallbacks = true;
  int finest_side_px = 1440;  // the photograph is halved until no side is longer; 64…8192

  // Throws UsageError.
  void check() const;
};

// A point of the surface (world mm) and where the photograph shows it (pixels).
struct PointPair {
  Eigen::Vector3d point_world_mm;
  Eigen::Vector2d pixel;
};

struct PhotoToRegister {
  Rgb8Image image;
  Rgb8Image mask;  // black: does not count; empty = all counts
  Intrinsics intrinsics;
  std::optional<RigidTransform> start;  // camera_from_world; none: searched for all round
  std::vector<PointPair> pairs;         // at least 6 make a start
  SeenDepth depth;                      // takes part in the pose; empty = unknown
};

enum class Verdict { ok, doubtful, failed };
const char* name_of(Verdict verdict);

// How the depth that a photograph came with agrees with a pose.
struct DepthFit {
  // Of the depth's neighbourhoods that the surface covers: those where it is what is seen; those
  // where it would stand before what is seen. In the others something stands before it.
  double share = 0, pierced_share = 0;
  // Robust standard deviation of the distance where it agrees; of the organ's distance that share.
  double noise_mm = 0, noise_share = 0;
  double scale = 1;  // mm of a unit of the depth
  // Of metric depth: what the scale would be if nothing were expected of it. A surface of the
  // organ's size has 1, but for the depth's own bias; one that is too large by 15 % has 1.15.
  double free_scale = 1;
  double scale_sd = 0;    // of free_scale, a share of it
  bool relative = false;  // the depth has no unit: free_scale is scale
  // By what share the pose leaves less of the depth unexplained than the best one elsewhere.
  double runner_up_margin = 1;
};

// What a pose is worth. Standard deviations are of the sandwich estimator over patches of the
// photograph, so that what the model leaves unexplained counts with its real correlation.
struct PoseQuality {
  Verdict verdict = Verdict::failed;
  std::string reason;        // why not ok; empty when ok
  double correlation = 0;    // R over the overlap
  double inlier_share = 0;   // of the organ's pixels, within 3 robust standard deviations
  double visible_share = 0;  // of the surface that faces the camera: inside the picture and counted
  double outline_asked_share = 0;  // of the outline: clear in the picture, so that it can confirm
  double outline_share = 0;        // of that: the photograph confirms it within a pixel
  double position_sd_mm = 0;       // of the organ's centre
  double rotation_sd_deg = 0;
  double surface_sd_mm = 0;  // RMS over the surface: the expected mTRE
  // By what share the pose leaves less of the photograph unexplained than the best one of the
  // search that is turned by more than 15°; 1 without one.
  double runner_up_margin = 1;
  double focal_scale = 1;         // found, or what a free focal length would want
  std::optional<DepthFit> depth;  // where depth took part
};

struct RegisteredPhoto {
  PosedCamera camera;  // intrinsics as found when the focal length was free
  PoseQuality quality;
  // As given, or as found by `automatic`, which stands for itself where colour alone told the pose.
  LightModel light = LightModel::camera;
};

// Aligns the photograph with the surface by maximising the normalised cross-correlation of photo
// and predicted shading (the paper, 2.1.1); where that fails near a start, or when
// Similarity::silhouette asks for it, the surface's silhouette with what has its colours
// (color_silhouette.cpp). Depth, where it is known, is sought for first, and then photograph and
// depth tell the pose together. Never throws for not finding the pose: that is what the verdict
// says. Throws BadDataError when intrinsics, image and mask do not fit together, UsageError for too
// few point pairs, and for a silhouette without a start or of an open surface. The same result for
// any number of threads.
RegisteredPhoto register_photo(const RegisteredSurface& surface, const PhotoToRegister& photo,
                               const RegistrationOptions& options, const RunContext& context = {});

// What a person judges a pose by at a glance: the photograph with the organ's outline in green
// (yellow when doubtful, red when failed), and on the organ a checkerboard that shows the predicted
// shading in every other field. At most 1600 pixels a side.
Rgb8Image draw_overlay(const RegisteredSurface& surface, const Rgb8Image& photo,
                       const RegisteredPhoto& registered);

// A clip's poses, frame by frame: each starts from the last good one, and looks no farther than a
// frame's motion while that holds. A frame whose pose is not ok is sought for from the last good
// one in a wider circle, and every so often all round, until the organ is found again.
class PoseTracker {
 public:
  // The surface outlives the tracker. Throws UsageError, BadDataError for bad intrinsics.
  PoseTracker(const RegisteredSurface& surface, const Intrinsics& intrinsics,
              const RegistrationOptions& options);

  // The next frame's pose, of the intrinsics' size; `mask` as of a photograph, or empty.
  RegisteredPhoto next(const Rgb8Image& frame, const Rgb8Image& mask = {},
                       const RunContext& context = {});
  // Where the first frame is looked for; all round without.
  void start_from(const RigidTransform& camera_from_world) { last_ = camera_from_world; }

 private:
  RegisteredPhoto seek(const PhotoToRegister& photo, const RunContext& context);

  const RegisteredSurface& surface_;
  Intrinsics intrinsics_;
  RegistrationOptions options_;
  std::optional<RigidTransform> last_;  // the last good pose
  std::optional<LightModel> light_;     // that it was found under
  int lost_frames_ = 0;                 // since it
};

// Where a scope was, camera_from_scene by frame, in the scene's own unit of length.
using ScopeMotion = std::map<std::size_t, RigidTransform>;

// A frame's pose of the surface, and how many mm the scene's unit of length has.
struct ScenePose {
  std::size_t frame = 0;
  RegisteredPhoto registered;
  double scale = 1;

  // camera_from_world at another frame of the motion, as the scene is rigid.
  RigidTransform at(const ScopeMotion& motion, std::size_t other) const;
};

// One pose of a rigid scene that serves all frames, and what the others tell of it.
struct SettledPose {
  ScenePose pose;        // the surest; as uncertain as the others disagree at least
  double drift_mm = 0;   // the most that another's own pose lies off it, mean over the surface
  double jitter_mm = 0;  // of the motion from frame to frame, a standard deviation
};
// Of at least one pose, each of a frame that the motion has.
SettledPose settled_pose(const RegisteredSurface& surface, const std::vector<ScenePose>& poses,
                         const ScopeMotion& motion);

}  // namespace organbake
