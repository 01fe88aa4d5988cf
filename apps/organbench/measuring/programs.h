// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "bench.h"
#include "measuring/scenes.h"
#include "organbake/bundle/bundle.h"
#include "organbake/core/run_context.h"
#include "organbake/shading/grid.h"
#include "organbake/warp/view.h"

// organbake's programs run as users run them: bakes, clips, what motion makes of them, and bundles
// for the player, whose frames are timed along an orbit.
namespace organbake {

// Bakes a recipe as users do, by the organbake that lies beside this program, with a cache in
// `folder`.
class Baker {
 public:
  // Throws NoInputError when there is no organbake.
  Baker(std::filesystem::path folder, RunContext context, const std::string& recipe);

  // `arguments`: --set, --force and the like. organbake's JSON about the run. Throws Error with
  // organbake's own words when it fails.
  nlohmann::ordered_json bake(const std::filesystem::path& bundle,
                              std::vector<std::string> arguments = {}) const;

 private:
  std::filesystem::path folder_;
  RunContext context_;
};

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

struct BakeChoice {
  int faces = 80;                 // of the proxy
  std::string method = "fitted";  // of the decimation
  int map_size = 1024;            // px
  bool elements = false;          // for the solver fem
  bool skin = true;               // smooth, over the proxy; else the proxy's own prisms
};

// Bundles of the phantom organ, baked as users bake them.
class PlayerBundles {
 public:
  // In `folder`; small: of few voxels and texels. Throws NoInputError when there is no organbake.
  PlayerBundles(std::filesystem::path folder, RunContext context, bool small);

  static constexpr int kCameras = 8;
  // Of the maps that are measured, px.
  int map_size() const { return small_ ? 256 : 1024; }
  // Baked when first asked for. Throws Error with organbake's own words when it fails.
  std::filesystem::path folder(const BakeChoice& choice);
  // Their truth as an engine would hold it: 20 · 4^subdivisions faces under a skin of 1024².
  // Made when first asked for.
  const SkinnedMesh& skinned_mesh(int subdivisions);

 private:
  std::filesystem::path folder_;
  RunContext context_;
  bool small_;
  Baker baker_;
  std::map<int, SkinnedMesh> skinned_;  // by subdivisions
};

inline constexpr int kFrames = 10;  // of one timing: an orbit, so that no frame is the last one

struct FrameSize {
  int width, height;
  double target_ms = 0;  // one thread, gradient-corrected, fill included
  std::string name() const { return std::to_string(width) + "×" + std::to_string(height); }
};

// Of the orbit: as near as a surgeon looks, the organ fills about 45 % of a wide picture.
View view_at(const Bundle& bundle, const FrameSize& size, int frame);

// From the middle between three cameras, all of which are drawn, hardly moving.
View view_between_three(const Bundle& bundle, const FrameSize& size, int frame);

// Of one of `count`, and of kFrames.
Timing of_one(Timing timing, std::size_t count);
double ms_of(const Timing& timing);

}  // namespace organbake
