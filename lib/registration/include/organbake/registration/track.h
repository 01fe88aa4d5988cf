// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>

#include "organbake/registration/register_photo.h"

namespace organbake {

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

}  // namespace organbake
