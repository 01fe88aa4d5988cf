// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "bench.h"
#include "depth_agreement.h"

// The suite of moving scopes, by what it measures.
namespace organbake {

// What `organbake motion` made of a clip, run as users run it.
struct MotionRun {
  std::filesystem::path folder;
  Timing timing;
  double peak_mb = 0;   // of the program
  std::string refusal;  // what it said where it ended with an error; empty when it did not
};
// `lens`: a file that holds it; empty = the clip has to tell.
MotionRun run_motion(Bench& bench, const std::filesystem::path& clip,
                     const std::filesystem::path& lens, const std::string& name);

// A program's or a map's depth file: planar, +inf = none.
Plane read_depth(const std::filesystem::path& exr);
// depth/ of a run: the numbers of the frames that have a map there.
std::vector<int> frames_with_depth(const std::filesystem::path& folder);
// The file of a frame in a folder: 000012 and the ending.
std::filesystem::path frame_file(const std::filesystem::path& folder, int frame,
                                 const std::string& ending);

// Clips of the phantom with their truth: path, depth, area seen; and those without parallax.
void promise_motion_of_phantom(Bench& bench);
// The shared video against COLMAP's model of it, and colmap itself where it is installed.
void promise_motion_of_video(Bench& bench);

}  // namespace organbake
