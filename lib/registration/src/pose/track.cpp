// SPDX-License-Identifier: GPL-3.0-or-later
// Poses along a clip, each from the one before, as long as they are ok.
#include "organbake/registration/track.h"

#include <algorithm>

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

}  // namespace organbake
