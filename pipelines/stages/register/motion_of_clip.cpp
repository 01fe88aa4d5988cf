// SPDX-License-Identifier: GPL-3.0-or-later
#include "stages/register/motion_of_clip.h"

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/pipelines/stage_module.h"

namespace organbake {

std::string find_motion_of_clip(const ClipToTrack& clip, const std::filesystem::path& folder,
                                const RunContext& context) {
  const Stage* motion = find_stage("motion");
  const StageOptions options = motion->make_options();
  make_folder(folder);
  const StageCall call{options.storage.get(),
                       {},
                       {{"frames", clip.video}, {"intrinsics", clip.intrinsics}},
                       folder,
                       context};
  try {
    return run_in_module(*motion, call).declined;
  } catch (const BadDataError& error) {
    return error.what();  // a video that nobody can read is told when its frames are read
  }
}

}  // namespace organbake
