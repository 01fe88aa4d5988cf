// SPDX-License-Identifier: GPL-3.0-or-later
#include "measuring/motion_run.h"

#include <algorithm>

#include "measuring/path_alignment.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/image/exr.h"
#include "organbake/pipelines/worker_process.h"

namespace organbake {
namespace fs = std::filesystem;
namespace {

// Without a round to warm up, which would leave its results in the cache of the one that counts.
constexpr double kOnce_s = 1e-9;

WorkerEnd call_organbake(std::vector<std::string> words, const fs::path& folder,
                         const RunContext& context) {
  words.insert(words.begin(), program_folder() / "organbake");
  words.insert(words.end(), {"--quiet", "-o", folder});
  const std::string logs = folder.string();
  return run_worker(words, logs + ".out", logs + ".log", context);
}

}  // namespace

fs::path make_motion_clip(const fs::path& folder, const std::vector<std::string>& options,
                          const RunContext& context) {
  if (!fs::exists(folder)) {
    context.info("making the clip " + folder.filename().string());
    std::vector<std::string> words = {"phantom", "--kind", "laparoscopy"};
    words.insert(words.end(), options.begin(), options.end());
    call_organbake(words, folder, context);
  }
  const fs::path video = folder / "clip.mp4";
  return fs::exists(video) ? video : folder / "frames";
}

MotionRun run_motion(const fs::path& clip, const fs::path& lens, const fs::path& folder,
                     const RunContext& context) {
  MotionRun run{folder, {}, 0, {}};
  std::vector<std::string> words = {"motion", clip};
  if (!lens.empty()) words.insert(words.end(), {"--intrinsics", lens});
  const auto work = [&] {
    try {
      run.peak_mb = call_organbake(words, folder, context).peak_mb;
    } catch (const CancelledError&) {
      throw;
    } catch (const Error& error) {
      run.refusal = error.what();
    }
  };
  run.timing = time_in_turn({work}, {.most = 1, .least = 1, .budget_s = kOnce_s}).front();
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

}  // namespace organbake
