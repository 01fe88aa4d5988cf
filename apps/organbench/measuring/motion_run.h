// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "measuring/measurement.h"
#include "organbake/core/run_context.h"
#include "organbake/shading/grid.h"

namespace organbake {

// A clip of the phantom's laparoscopy in a folder, made by `organbake phantom` with these options
// where it is not there yet; returns its video, or its folder of frames.
std::filesystem::path make_motion_clip(const std::filesystem::path& folder,
                                       const std::vector<std::string>& options,
                                       const RunContext& context);

// What `organbake motion` made of a clip, run as users run it.
struct MotionRun {
  std::filesystem::path folder;
  Timing timing;
  double peak_mb = 0;   // of the program
  std::string refusal;  // what it said where it ended with an error; empty when it did not
};
// Into `folder`, with its logs beside that. `lens`: a file that holds it; empty = the clip has to
// tell.
MotionRun run_motion(const std::filesystem::path& clip, const std::filesystem::path& lens,
                     const std::filesystem::path& folder, const RunContext& context);

// A program's or a map's depth file: planar, +inf = none.
Plane read_depth(const std::filesystem::path& exr);
// depth/ of a run: the numbers of the frames that have a map there.
std::vector<int> frames_with_depth(const std::filesystem::path& folder);
// The file of a frame in a folder: 000012 and the ending.
std::filesystem::path frame_file(const std::filesystem::path& folder, int frame,
                                 const std::string& ending);

}  // namespace organbake
