// SPDX-License-Identifier: Apache-2.0
#pragma once

// Plays a script, and holds its frames against those of an earlier run.

#include <algorithm>
#include <filesystem>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/image/channel_image.h"
#include "organbake/player/player.h"
#include "organbake/player/script.h"

namespace organbake {

// One moment of a script, stepped and drawn.
struct PlayedScene {
  int frame;
  double time_s;
  const View& view;
  const std::vector<Instrument>& instruments;  // where they were held
  const std::vector<Solid>& solids;            // the tools that are in the picture
  const StepReport& step;
  Frame& picture;  // may be taken, or drawn over
};

struct PlayOptions {
  int width = 1280, height = 720;  // pixels; the script's own size goes first
  bool instruments = true;         // draw the tools
  // How many frames of the script to play, at most: a tool comes through the trocar that suits the
  // whole script, however much of it is played.
  int most_frames = std::numeric_limits<int>::max();
  int frames_of(const Script& script) const { return std::min(script.frames, most_frames); }
  // A lens in the place of the script's own, with the size of its pictures; without distortion.
  std::optional<Intrinsics> lens = {};
  DrawOptions draw;
  std::function<void(const PlayedScene&)> watch;  // may be empty; called after `show`

  void check() const;  // throws UsageError
};

struct PlayedFrame {
  double deform_ms = 0, draw_ms = 0;
  DrawReport draw;
  StepReport step;
};

// Plays a script from rest and hands every finished frame to `show` (which may be empty). Throws
// what `show` throws, CancelledError, and UsageError or BadDataError for a script that the organ
// cannot follow.
std::vector<PlayedFrame> play(Player& player, const Script& script, const PlayOptions& options,
                              const std::function<void(int frame, const Frame&)>& show,
                              const RunContext& context = {});

// The JSON report (play-report.schema.json): the solver, per frame and in summary the times by
// phase, what was skipped and why, holes, contacts and forces. Times are the one thing in it that
// differs from run to run.
std::string play_report(const Script& script, const Player& player,
                        const std::vector<PlayedFrame>& frames);

// "frame_0000.png": what a script's frames are called.
std::string frame_file_name(int frame);

// The pictures of an earlier run, frame_0000.png and so on, that a script's frames are held
// against.
class ReferenceFrames {
 public:
  // Throws NoInputError without the folder, BadDataError unless it holds pictures for exactly
  // `frames` frames.
  ReferenceFrames(std::filesystem::path folder, int frames);

  // Throws BadDataError for a picture that cannot be read or has another size.
  void compare(int frame, const Rgb8Image& picture);

  // Of the frames compared; +inf when all are equal.
  double least_psnr_db() const { return least_psnr_db_; }
  int worst_frame() const { return worst_frame_; }
  // Throws Error (quality gate) when a frame's PSNR is below the threshold.
  void check(double threshold_db) const;

 private:
  std::filesystem::path folder_;
  double least_psnr_db_ = std::numeric_limits<double>::infinity();
  int worst_frame_ = 0;
};

}  // namespace organbake
