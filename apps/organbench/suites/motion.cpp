// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/image/exr.h"
#include "organbake/pipelines/stage.h"
#include "organbake/pipelines/worker_process.h"
#include "path_alignment.h"
#include "suites.h"
#include "suites/motion_parts.h"

namespace organbake {
namespace fs = std::filesystem;

MotionRun run_motion(Bench& bench, const fs::path& clip, const fs::path& lens,
                     const std::string& name) {
  MotionRun run;
  run.folder = bench.scratch() / name;
  std::vector<std::string> command = {
      program_folder() / "organbake", "motion", clip, "-o", run.folder, "--quiet"};
  if (!lens.empty()) command.insert(command.end(), {"--intrinsics", lens});
  const auto work = [&] {
    try {
      run.peak_mb = run_worker(command, bench.scratch() / (name + ".out"),
                               bench.scratch() / (name + ".log"), bench.context())
                        .peak_mb;
    } catch (const CancelledError&) {
      throw;
    } catch (const Error& error) {
      run.refusal = error.what();
    }
  };
  run.timing = time_in_turn({work}, {.most = 1, .least = 1}).front();
  return run;
}

Plane read_depth(const fs::path& exr) {
  const ChannelImage image = read_exr(exr);
  Plane depth(image.width, image.height);
  depth.values = image.floats("Z", exr.string());
  return depth;
}

fs::path frame_file(const fs::path& folder, int frame, const std::string& ending) {
  constexpr std::size_t kDigits = 6;
  return folder / (padded(static_cast<std::size_t>(frame), kDigits) + ending);
}

std::vector<int> frames_with_depth(const fs::path& folder) {
  std::vector<int> frames;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder, none))
    if (const auto frame = frame_of_name(entry.path().filename())) frames.push_back(*frame);
  std::sort(frames.begin(), frames.end());
  return frames;
}

void run_motion_suite(Bench& bench) {
  if (!find_stage("motion")) {
    bench.skip("motion", "this organbake has no stage of that name");
    return;
  }
  promise_motion_of_phantom(bench);
  promise_motion_of_video(bench);
}

}  // namespace organbake
