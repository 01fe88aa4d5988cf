// SPDX-License-Identifier: GPL-3.0-or-later
//
// A rigid scene from the views of a clip, one after another (Schönberger & Frahm 2016): a first
// pair by its essential matrix (Nistér 2004; MAGSAC++, Barath et al. 2020), each next view from the
// places that it sees, new places from posed views, and bundle adjustment as the scene grows. In:
// sightings and a lens to start from. Out: poses, places, lens; or why there are none.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

#include "organbake/core/parallel.h"
#include "organbake/core/quantile.h"
#include "organbake/core/text.h"
#include "organbake/motion/clip_motion.h"
#include "organbake/motion/scene.h"
#include "two_views.h"

namespace organbake {
namespace {

constexpr std::size_t kFewestPairs = 30;
constexpr double kAgreesWithPair_px =
    1.5;  // tracked to half a pixel, over tissue that is not quite rigid

using RayPoints = std::vector<cv::Point2d>;

RayPoints straight(const Intrinsics& lens, const std::vector<Eigen::Vector2d>& pixels) {
  RayPoints points;
  points.reserve(pixels.size());
  for (const Eigen::Vector2d& pixel : pixels) {
    const Eigen::Vector3d ray = unproject(lens, pixel);
    points.emplace_back(ray.x(), ray.y());
  }
  return points;
}

double parallax_px(const RayPoints& a, const RayPoints& b, double focal_px) {
  cv::Mat inliers;
  const cv::Mat h =
      cv::findHomography(a, b, cv::USAC_MAGSAC, kAgreesWithPair_px / focal_px, inliers, 500);
  if (h.empty()) return 0;
  RayPoints moved;
  cv::perspectiveTransform(a, moved, h);
  std::vector<double> apart;
  for (std::size_t i = 0; i < a.size(); ++i)
    apart.push_back(std::hypot(moved[i].x - b[i].x, moved[i].y - b[i].y) * focal_px);
  const auto upper = apart.begin() + static_cast<std::ptrdiff_t>(apart.size() * 4 / 5);
  std::nth_element(apart.begin(), upper, apart.end());
  return *upper;
}

}  // namespace

TwoViews relate_views(const Intrinsics& lens, const std::vector<Eigen::Vector2d>& first,
                      const std::vector<Eigen::Vector2d>& second) {
  TwoViews result;
  if (first.size() < kFewestPairs) return result;
  const RayPoints a = straight(lens, first), b = straight(lens, second);
  cv::Mat inliers;
  const cv::Mat essential =
      cv::findEssentialMat(a, b, cv::Mat::eye(3, 3, CV_64F), cv::USAC_MAGSAC, 0.999,
                           kAgreesWithPair_px / lens.fx, 1000, inliers);
  if (essential.rows != 3) return result;
  cv::Mat rotation, translation, points;
  constexpr double kFarthest = 1e3;  // baselines
  result.agreeing = static_cast<std::size_t>(
      std::max(0, cv::recoverPose(essential, a, b, cv::Mat::eye(3, 3, CV_64F), rotation,
                                  translation, kFarthest, inliers, points)));
  cv::cv2eigen(rotation, result.second_from_first.rotation);
  cv::cv2eigen(translation, result.second_from_first.translation);
  std::vector<double> angles;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (!inliers.at<std::uint8_t>(static_cast<int>(i))) continue;
    const Eigen::Vector3d ray_a(a[i].x, a[i].y, 1), ray_b(b[i].x, b[i].y, 1);
    const Eigen::Vector3d turned = result.second_from_first.rotation * ray_a;
    angles.push_back(std::atan2(turned.cross(ray_b).norm(), turned.dot(ray_b)));
  }
  result.median_angle_rad = median(std::move(angles));
  result.parallax_px = parallax_px(a, b, lens.fx);
  return result;
}

namespace {

SeenPlaces places_seen_by(const Scene& scene, std::size_t view) {
  SeenPlaces seen;
  for (const Landmark& landmark : scene.landmarks)
    if (landmark.place)
      if (const Sighting* sighting = sighting_in(landmark, view)) {
        seen.places.push_back(*landmark.place);
        seen.pixels.push_back(sighting->pixel);
      }
  return seen;
}

std::optional<RigidTransform> pose_by_chance(const Intrinsics& lens, const SeenPlaces& seen) {
  constexpr double kAgrees_px = 4;
  std::vector<cv::Point3d> places;
  for (const Eigen::Vector3d& place : seen.places)
    places.emplace_back(place.x(), place.y(), place.z());
  cv::Mat turn, translation;
  if (!cv::solvePnPRansac(places, straight(lens, seen.pixels), cv::Mat::eye(3, 3, CV_64F),
                          cv::noArray(), turn, translation, false, 300,
                          static_cast<float>(kAgrees_px / lens.fx), 0.999, cv::noArray(),
                          cv::SOLVEPNP_AP3P))
    return std::nullopt;
  cv::Mat rotation;
  cv::Rodrigues(turn, rotation);
  RigidTransform pose;
  cv::cv2eigen(rotation, pose.rotation);
  cv::cv2eigen(translation, pose.translation);
  return pose;
}

// Finds the pose of a view from the places that it sees: three points at a time by OpenCV's RANSAC
// (Fischler & Bolles 1981), then all that agree. False, and no pose, when too few of them agree:
// the view sees something else that moves. Deterministic.
bool pose_view(std::size_t view, Scene& scene) {
  constexpr std::size_t kFewestAgreeing = 20;
  constexpr double kLeastAgreeing = 0.2;  // share
  const SeenPlaces seen = places_seen_by(scene, view);
  if (seen.places.size() < kFewestAgreeing) return false;
  std::optional<RigidTransform> pose = pose_by_chance(scene.lens, seen);
  if (!pose) return false;
  const std::size_t agreeing = adjust_pose(scene.lens, seen, *pose);
  if (agreeing < kFewestAgreeing || double(agreeing) < kLeastAgreeing * double(seen.places.size()))
    return false;
  scene.camera_from_world[view] = *pose;
  return true;
}

struct Pair {
  std::size_t first = 0, second = 0;
  TwoViews relation;
};

TwoViews relate(const Scene& scene, std::size_t a, std::size_t b) {
  std::vector<Eigen::Vector2d> first, second;
  for (const std::size_t i : seen_by_both(scene.landmarks, a, b)) {
    first.push_back(sighting_in(scene.landmarks[i], a)->pixel);
    second.push_back(sighting_in(scene.landmarks[i], b)->pixel);
  }
  return relate_views(scene.lens, first, second);
}

// Pairs from near to far apart, spread over the clip.
std::vector<Pair> candidate_pairs(const Scene& scene, const std::vector<std::size_t>& keys) {
  constexpr std::size_t kStarts = 8;
  const std::size_t step = std::max<std::size_t>(1, keys.size() / kStarts);
  std::vector<Pair> pairs;
  for (std::size_t first = 0; first < keys.size(); first += step)
    for (const std::size_t apart : {1, 2, 4, 8, 16})
      if (first + apart < keys.size()) pairs.push_back({keys[first], keys[first + apart], {}});
  parallel_for(std::size_t{0}, pairs.size(), [&](std::size_t i) {
    pairs[i].relation = relate(scene, pairs[i].first, pairs[i].second);
  });
  return pairs;
}

// The views that the scene grows by: so many hold it, and each more costs another adjustment.
std::vector<std::size_t> keys_among(std::size_t views) {
  constexpr std::size_t kMost = 24;
  const std::size_t step = (views + kMost - 1) / kMost;
  std::vector<std::size_t> keys;
  for (std::size_t view = 0; view < views; view += std::max<std::size_t>(1, step))
    keys.push_back(view);
  return keys;
}

class Growth {
 public:
  Growth(const FreeLens& lens, Scene& scene, const RunContext& context)
      : lens_(lens),
        scene_(scene),
        context_(context),
        keys_(keys_among(scene.camera_from_world.size())) {}

  std::string run() {
    if (scene_.posed_views() < 2)
      if (const std::string failure = begin_with_pair(); !failure.empty()) return failure;
    triangulate(scene_);
    // Two views bend any lens to what they like: it is held until there are more.
    settle_all({}, 10);
    grow();
    add_others();
    return "";
  }

 private:
  std::string begin_with_pair() {
    const std::vector<Pair> pairs = candidate_pairs(scene_, keys_);
    double most_parallax_px = 0;
    for (const Pair& pair : pairs)
      most_parallax_px = std::max(most_parallax_px, pair.relation.parallax_px);
    const auto best =
        std::max_element(pairs.begin(), pairs.end(),
                         [&](const Pair& a, const Pair& b) { return worth(a) < worth(b); });
    if (best == pairs.end() || worth(*best) <= 0)
      return "no two frames see the tissue from places far enough apart (parallax of " +
             to_text(most_parallax_px, 1) + " pixels)";
    scene_.camera_from_world[best->first] = RigidTransform{};
    scene_.camera_from_world[best->second] = best->relation.second_from_first;
    return "";
  }

  // A pair that a plane, a pure turn or a zoom explains to two pixels tells no shape. A lens's
  // distortion looks like parallax, the more the larger the picture is.
  double worth(const Pair& pair) const {
    constexpr double kLeastParallax_px = 2, kUsualWidth = 1280, kLeastAngle_rad = 0.02,
                     kWideEnough_rad = 0.1;
    const double of_usual = std::clamp(scene_.lens.width / kUsualWidth, 0.5, 1.0),
                 angle_rad = pair.relation.median_angle_rad;
    if (pair.relation.parallax_px < kLeastParallax_px * of_usual || angle_rad < kLeastAngle_rad)
      return 0;
    // Many pairs under an angle at which depth is sure; wider ones see each other less well.
    return static_cast<double>(pair.relation.agreeing) * std::min(angle_rad, kWideEnough_rad);
  }

  // The unposed key that sees most places.
  std::optional<std::size_t> next_view(const std::vector<bool>& refused) const {
    std::vector<std::size_t> places(scene_.camera_from_world.size(), 0);
    for (const Landmark& landmark : scene_.landmarks)
      if (landmark.place)
        for (const Sighting& sighting : landmark.seen) ++places[sighting.view];
    std::optional<std::size_t> best;
    for (const std::size_t view : keys_) {
      if (scene_.is_posed(view) || refused[view]) continue;
      if (!best || places[view] > places[*best]) best = view;
    }
    return best;
  }

  void grow() {
    std::vector<bool> refused(scene_.camera_from_world.size(), false);
    std::size_t settled_at = scene_.posed_views();
    while (const auto view = next_view(refused)) {
      context_.throw_if_cancelled();
      refused[*view] = !pose_view(*view, scene_);
      if (refused[*view]) continue;
      triangulate(scene_, view);
      settle_near(*view);
      // All views together are dear: they move when the scene has grown by a quarter, or by eight.
      const std::size_t posed = scene_.posed_views();
      context_.progress(static_cast<double>(posed) / static_cast<double>(keys_.size()));
      if (posed * 4 < settled_at * 5 && posed < settled_at + 8) continue;
      settle_all(lens_now(posed), 10);
      settled_at = posed;
      // Places have moved, and there are more of them: who was refused may agree now.
      std::fill(refused.begin(), refused.end(), false);
    }
  }

  // A lens is told by several views only, and what it does at the borders by more.
  FreeLens lens_now(std::size_t posed) const {
    return {lens_.focal && posed >= 4, lens_.distortion && posed >= 6};
  }

  void settle_all(const FreeLens& lens, int iterations) {
    settle({.lens = lens, .iterations = iterations, .tolerance = 1e-3, .sightings_per_view = 250},
           scene_);
  }

  // The new view and those around it, the others held.
  void settle_near(std::size_t view) {
    const std::size_t near = 3 * (keys_.size() > 1 ? keys_[1] - keys_[0] : 1);
    std::vector<bool> moving(scene_.camera_from_world.size(), false);
    for (std::size_t other = 0; other < moving.size(); ++other)
      moving[other] = scene_.is_posed(other) && other + near >= view && other <= view + near;
    // Somebody has to hold the scene where it is.
    if (std::count(moving.begin(), moving.end(), true) ==
        static_cast<std::ptrdiff_t>(scene_.posed_views()))
      moving.clear();
    adjust({.iterations = 4, .tolerance = 1e-3, .sightings_per_view = 120, .moving = moving},
           scene_);
  }

  // The views between the keys, each from the places that it sees; as long as some more become
  // known by others.
  void add_others() {
    settle_all(lens_now(scene_.posed_views()), 15);
    for (std::size_t posed = 0; posed < scene_.posed_views();) {
      context_.throw_if_cancelled();
      posed = scene_.posed_views();
      parallel_for(std::size_t{0}, scene_.camera_from_world.size(), [&](std::size_t view) {
        if (!scene_.is_posed(view)) pose_view(view, scene_);
      });
      triangulate(scene_);
    }
    settle_all(lens_, 20);
  }

  const FreeLens lens_;
  Scene& scene_;
  const RunContext& context_;
  const std::vector<std::size_t> keys_;
};

}  // namespace

std::string reconstruct(const FreeLens& lens, Scene& scene, const RunContext& context) {
  return Growth(lens, scene, context).run();
}

}  // namespace organbake
