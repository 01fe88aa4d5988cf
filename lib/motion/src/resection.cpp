// SPDX-License-Identifier: GPL-3.0-or-later
#include "resection.h"

#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

#include "organbake/motion/bundle_adjustment.h"

namespace organbake {
namespace {

constexpr std::size_t kFewestAgreeing = 20;
constexpr double kAgreesWithPose_px = 4;

struct SeenPlaces {
  std::vector<Eigen::Vector3d> places;
  std::vector<Eigen::Vector2d> pixels;
};

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
  std::vector<cv::Point3d> places;
  std::vector<cv::Point2d> rays;
  for (std::size_t i = 0; i < seen.places.size(); ++i) {
    const Eigen::Vector3d& place = seen.places[i];
    places.emplace_back(place.x(), place.y(), place.z());
    const Eigen::Vector3d ray = unproject(lens, seen.pixels[i]);
    rays.emplace_back(ray.x(), ray.y());
  }
  cv::Mat turn, translation;
  if (!cv::solvePnPRansac(places, rays, cv::Mat::eye(3, 3, CV_64F), cv::noArray(), turn,
                          translation, false, 300, static_cast<float>(kAgreesWithPose_px / lens.fx),
                          0.999, cv::noArray(), cv::SOLVEPNP_AP3P))
    return std::nullopt;
  cv::Mat rotation;
  cv::Rodrigues(turn, rotation);
  RigidTransform pose;
  cv::cv2eigen(rotation, pose.rotation);
  cv::cv2eigen(translation, pose.translation);
  return pose;
}

}  // namespace

bool pose_view(double least_agreeing_share, std::size_t view, Scene& scene) {
  const SeenPlaces seen = places_seen_by(scene, view);
  if (seen.places.size() < kFewestAgreeing) return false;
  std::optional<RigidTransform> pose = pose_by_chance(scene.lens, seen);
  if (!pose) return false;
  const std::size_t agreeing =
      adjust_pose(scene.lens, seen.places, seen.pixels, kAgreesWithPose_px, *pose);
  if (agreeing < kFewestAgreeing ||
      static_cast<double>(agreeing) <
          least_agreeing_share * static_cast<double>(seen.places.size()))
    return false;
  scene.camera_from_world[view] = *pose;
  return true;
}

}  // namespace organbake
