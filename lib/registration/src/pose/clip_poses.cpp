// SPDX-License-Identifier: GPL-3.0-or-later
// Poses along a clip: each from the one before, as long as they are ok; or, where the scope's
// motion through a rigid scene is known, one pose for all frames, held against what others tell.
#include "organbake/registration/register_photo.h"

#include <algorithm>
#include <cmath>

#include "organbake/core/text.h"

namespace organbake {
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
