// SPDX-License-Identifier: GPL-3.0-or-later
// A pose as the solver moves it, about the object's own centre, with its derivatives in the
// picture; and a first one from point pairs. And poses along a clip: each from the one before, as
// long as they are ok; or, where the scope's motion through a rigid scene is known, one pose for
// all frames, held against what others tell.
#include "organbake/registration/registered_surface.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>

#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/registration/register_photo.h"
#include "pose/poses.h"

namespace organbake {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

Quaterniond exponential(const Vector3d& rotation) {
  return Quaterniond(Eigen::AngleAxisd(rotation.norm(), rotation.stableNormalized()));
}

Matrix3d cross_matrix(const Vector3d& v) {
  Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

// d pixel / d camera point (mm), distortion included; the point lies in front of the camera.
Eigen::Matrix<double, 2, 3> projection_jacobian(const Intrinsics& k, const Vector3d& p) {
  const double x = p.x() / p.z(), y = p.y() / p.z();
  Eigen::Matrix<double, 2, 3> normalised;
  normalised << 1 / p.z(), 0, -x / p.z(), 0, 1 / p.z(), -y / p.z();
  Eigen::Matrix2d lens = Eigen::Matrix2d::Identity();
  if (k.has_distortion()) {
    const double r2 = x * x + y * y;
    const double radial = 1 + r2 * (k.k1 + r2 * (k.k2 + r2 * k.k3));
    const double slope = 2 * (k.k1 + r2 * (2 * k.k2 + 3 * r2 * k.k3));  // d radial / d(r²), twice
    lens(0, 0) = radial + slope * x * x + 2 * k.p1 * y + 6 * k.p2 * x;
    lens(0, 1) = slope * x * y + 2 * k.p1 * x + 2 * k.p2 * y;
    lens(1, 0) = lens(0, 1);
    lens(1, 1) = radial + slope * y * y + 6 * k.p1 * y + 2 * k.p2 * x;
  }
  return Eigen::Vector2d(k.fx, k.fy).asDiagonal() * lens * normalised;
}

}  // namespace

std::array<double, 7> ObjectPose::to_array() const {
  const auto& q = camera_from_world;
  const auto& c = center_camera_mm;
  return {q.x(), q.y(), q.z(), q.w(), c.x(), c.y(), c.z()};
}

ObjectPose ObjectPose::from_array(const double* values) {
  ObjectPose pose;
  pose.camera_from_world = Quaterniond(values[3], values[0], values[1], values[2]).normalized();
  pose.center_camera_mm = Vector3d(values[4], values[5], values[6]);
  return pose;
}

ObjectPose object_pose(const RigidTransform& camera_from_world, const Vector3d& center_world_mm) {
  return {Quaterniond(camera_from_world.rotation).normalized(),
          camera_from_world * center_world_mm};
}

RigidTransform rigid_transform(const ObjectPose& pose, const Vector3d& center_world_mm) {
  RigidTransform transform;
  transform.rotation = pose.camera_from_world.toRotationMatrix();
  transform.translation = pose.center_camera_mm - transform.rotation * center_world_mm;
  return transform;
}

ObjectPose moved(const ObjectPose& pose, const Motion& motion) {
  return {(exponential(motion.head<3>()) * pose.camera_from_world).normalized(),
          pose.center_camera_mm + motion.tail<3>()};
}

Motion motion_between(const ObjectPose& from, const ObjectPose& to) {
  const Eigen::AngleAxisd turn(to.camera_from_world * from.camera_from_world.conjugate());
  double angle = turn.angle();
  if (angle > M_PI) angle -= 2 * M_PI;
  Motion motion;
  motion << angle * turn.axis(), to.center_camera_mm - from.center_camera_mm;
  return motion;
}

Eigen::Matrix<double, 2, 6> pixel_motion(const Intrinsics& intrinsics, const Vector3d& point,
                                         const Vector3d& center) {
  const Eigen::Matrix<double, 2, 3> projection = projection_jacobian(intrinsics, point);
  Eigen::Matrix<double, 2, 6> motion;
  motion << -projection * cross_matrix(point - center), projection;
  return motion;
}

Intrinsics reduced(const Intrinsics& intrinsics, int factor) {
  Intrinsics small = intrinsics;
  small.width = intrinsics.width / factor;
  small.height = intrinsics.height / factor;
  small.fx /= factor;
  small.fy /= factor;
  small.cx /= factor;
  small.cy /= factor;
  return small;
}

// A pose from point pairs, clicked by hand: most of those that one pose explains (RANSAC), then the
// best for them all (Terzakis & Lourakis, SQPnP, 2020).
RigidTransform pose_from_pairs(const std::vector<PointPair>& pairs, const Intrinsics& lens) {
  constexpr std::size_t kFewest = 6;
  if (pairs.size() < kFewest) {
    throw UsageError("point pairs: " + std::to_string(pairs.size()) + " given, at least " +
                     std::to_string(kFewest) + " fix a pose");
  }
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> rays;  // of a lens with the focal length 1
  Eigen::Matrix3Xd places(3, pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Vector3d& place = pairs[i].point_world_mm;
    const Vector3d ray = unproject(lens, pairs[i].pixel);
    points.emplace_back(place.x(), place.y(), place.z());
    rays.emplace_back(ray.x(), ray.y());
    places.col(static_cast<Eigen::Index>(i)) = place;
  }
  places.colwise() -= places.rowwise().mean().eval();
  const Vector3d extents = places.jacobiSvd().singularValues();
  constexpr double kFlat = 1e-6, kMisclicked_px = 8, kSure = 0.999;
  constexpr int kTries = 100;
  cv::Vec3d turn, shift;
  if (!(extents[2] > kFlat * extents[0]) ||
      !cv::solvePnPRansac(points, rays, cv::Matx33d::eye(), cv::noArray(), turn, shift, false,
                          kTries, kMisclicked_px / lens.fx, kSure, cv::noArray(),
                          cv::SOLVEPNP_SQPNP)) {
    throw UsageError("the point pairs do not fix a pose: take points that do not lie in one plane");
  }
  cv::Matx33d rotation;
  cv::Rodrigues(turn, rotation);
  return {Eigen::Matrix<double, 3, 3, Eigen::RowMajor>::Map(rotation.val),
          Vector3d::Map(shift.val)};
}

namespace {

constexpr int kTrackedSide = 400;      // pixels: enough for tenths of a millimetre
constexpr int kLookAllRoundEach = 10;  // lost frames

}  // namespace

PoseTracker::PoseTracker(const RegisteredSurface& surface, const Intrinsics& intrinsics,
                         const RegistrationOptions& options)
    : surface_(surface), intrinsics_(intrinsics), options_(options) {
  options_.check();
  intrinsics_.check();
  options_.fallbacks = false;  // only poses that are ok are followed
}

RegisteredPhoto PoseTracker::next(const Rgb8Image& frame, const Rgb8Image& mask,
                                  const RunContext& context) {
  PhotoToRegister photo;
  photo.image = frame;
  photo.mask = mask;
  photo.intrinsics = intrinsics_;
  photo.start = last_;
  if (last_ && light_ && lost_frames_ == 0) {
    RegistrationOptions quick = options_;
    quick.light = *light_;
    quick.free_focal = false;  // one lens for the clip
    quick.range = SearchRange::one_frame;
    quick.finest_side_px = std::min(options_.finest_side_px, kTrackedSide);
    const RegisteredPhoto found = register_photo(surface_, photo, quick, context);
    if (found.quality.verdict == Verdict::ok) {
      last_ = found.camera.camera_from_world;
      return found;
    }
  }
  return seek(photo, context);
}

RegisteredPhoto PoseTracker::seek(const PhotoToRegister& photo, const RunContext& context) {
  PhotoToRegister sought = photo;
  if (lost_frames_ % kLookAllRoundEach == kLookAllRoundEach - 1) sought.start.reset();
  const RegisteredPhoto found = register_photo(surface_, sought, options_, context);
  if (found.quality.verdict != Verdict::ok) {
    ++lost_frames_;
    return found;
  }
  lost_frames_ = 0;
  last_ = found.camera.camera_from_world;
  light_ = found.light;
  if (options_.free_focal) intrinsics_ = found.camera.intrinsics;
  return found;
}

RigidTransform ScenePose::at(const ScopeMotion& motion, std::size_t other) const {
  RigidTransform moved = motion.at(other) * motion.at(frame).inverse();
  moved.translation *= scale;
  return moved * registered.camera.camera_from_world;
}

namespace {

bool surer(const ScenePose& a, const ScenePose& b) {
  const PoseQuality &p = a.registered.quality, &q = b.registered.quality;
  return p.verdict != q.verdict ? p.verdict < q.verdict : p.surface_sd_mm < q.surface_sd_mm;
}

// What the key frames' own poses are off the surest one's.
struct KeySpread {
  double drift_mm = 0;  // the most
  double sd_mm = 0;     // of one of them
};

// What the motion bends or scales wrongly all key frames share, and no difference shows it: a
// difference's variance stands for one's, of which it would be twice if they erred independently.
KeySpread spread_of(const RegisteredSurface& surface, const std::vector<ScenePose>& keys,
                    const ScenePose& surest, const ScopeMotion& motions) {
  KeySpread spread;
  double squares = 0, count = 0;
  for (const ScenePose& key : keys) {
    if (key.registered.quality.verdict == Verdict::failed || key.frame == surest.frame) continue;
    const double apart = surface.mean_distance_mm(key.registered.camera.camera_from_world,
                                                  surest.at(motions, key.frame));
    spread.drift_mm = std::max(spread.drift_mm, apart);
    squares += apart * apart;
    ++count;
  }
  if (count > 0) spread.sd_mm = std::sqrt(squares / count);
  return spread;
}

// A key frame's own scatter does not show what bends all of its depth; that it bends another key
// frame's otherwise does.
void widen(double sd_mm, PoseQuality& quality) {
  constexpr double kSure_mm = 1;
  if (!(sd_mm > quality.surface_sd_mm) || !(quality.surface_sd_mm > 0)) return;
  const double factor = sd_mm / quality.surface_sd_mm;
  quality.position_sd_mm *= factor;
  quality.rotation_sd_deg *= factor;
  quality.surface_sd_mm = sd_mm;
  if (quality.verdict != Verdict::ok || sd_mm <= kSure_mm) return;
  quality.verdict = Verdict::doubtful;
  quality.reason = "the pose is uncertain by " + to_text(sd_mm, 2) +
                   " mm on the surface, by which key frames disagree";
}

// RMS of what the middle one of three neighbouring frames is off the mean of the others: of errors
// that are independent from frame to frame, their standard deviation.
double jitter_mm(const RegisteredSurface& surface, const ScenePose& pose,
                 const ScopeMotion& motions) {
  constexpr double kOfThree = 1.5;  // variance of a middle less half of either neighbour
  double squares = 0, count = 0;
  for (const auto& [frame, camera] : motions) {
    if (!motions.contains(frame + 1) || !motions.contains(frame + 2)) continue;
    const Eigen::Vector3d& center = surface.center();
    const Eigen::Vector3d off =
        pose.at(motions, frame + 1) * center -
        (pose.at(motions, frame) * center + pose.at(motions, frame + 2) * center) / 2;
    squares += off.squaredNorm() / kOfThree;
    ++count;
  }
  return count > 0 ? std::sqrt(squares / count) : 0;
}

}  // namespace

SettledPose settled_pose(const RegisteredSurface& surface, const std::vector<ScenePose>& poses,
                         const ScopeMotion& motion) {
  SettledPose settled{*std::min_element(poses.begin(), poses.end(), surer)};
  const KeySpread spread = spread_of(surface, poses, settled.pose, motion);
  widen(spread.sd_mm, settled.pose.registered.quality);
  settled.drift_mm = spread.drift_mm;
  settled.jitter_mm = jitter_mm(surface, settled.pose, motion);
  return settled;
}

}  // namespace organbake
