// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/core/run_context.h"
#include "organbake/deform/deformer.h"
#include "organbake/image/channel_image.h"
#include "organbake/instruments/instrument.h"
#include "organbake/player/orbit.h"
#include "organbake/player/player.h"
#include "organbake/warp/draw_options.h"
#include "organbake/warp/view.h"

namespace organbake {

inline constexpr int kMostScriptFrames = 100000;

// On the orbit, or a pose of the world's. All of a script are of one kind.
struct CameraKeyframe {
  int frame = 0;
  OrbitPose pose;
  std::optional<RigidTransform> camera_from_world = {};
};

// What happens in front of the player's eye, frame by frame. Schema: interaction.schema.json.
struct Script {
  std::string name;
  double time_step_s = 1.0 / 60;
  int frames = 1;
  int width = 0, height = 0;  // 0 = the player's choice
  // What stood for the tissue when it was recorded, and has to again to repeat it.
  std::optional<TissueSolver> solver = {};
  // In which frames cuts part (Player::CutTimes), when it was recorded live; else six steps after
  // the blade.
  std::optional<std::vector<std::uint32_t>> cuts_part_in = {};
  std::optional<DrawnLight> light = {};  // to be seen in; else what the organ is meant for
  std::vector<CameraKeyframe> camera;
  std::optional<Intrinsics> lens = {};  // of the script's size; else virtual camera 0's angle
  // In the keyframes' place: a camera a frame, all of one size, and the file they were read from.
  std::vector<PosedCamera> recorded = {};
  std::string recorded_file = {};
  std::vector<InstrumentPath> instruments;
  // Where another solver has the first organ's vertices, frame by frame, x y z of each; from the
  // first again after the last. Then there are no instruments.
  std::vector<std::vector<double>> vertices_mm = {};
};

// Throws BadDataError naming `name` and the key; NoInputError.
Script script_from_json(const std::string& text, const std::string& name);
Script read_script(const std::filesystem::path& path);
// The document that script_from_json() reads back to the last bit.
std::string script_to_json(const Script& script);

// The camera on the orbit at a frame: Catmull–Rom between keyframes, so that it never jerks; held
// at the ends.
OrbitPose camera_at(const Script& script, int frame);

// Plays the script from these cameras instead of its own. Throws UsageError naming `name` for
// distortion, several sizes or fewer cameras than frames. A script without a size takes theirs.
void take_recorded(const CameraSet& cameras, const std::string& name, Script& script);

// Who looks at a frame, in a picture of width × height pixels: intrinsics that were given for
// another size are scaled. Throws UsageError as orbit_view() does.
View view_at(const Script& script, int frame, const CameraSet& cameras, int width, int height);
// A camera's view in another size.
View view_of(const PosedCamera& camera, int width, int height);

// A script's instruments with every waypoint brought to world millimetres.
class InstrumentMotion {
 public:
  // Throws BadDataError, naming the script and the key, where a direction meets no skin.
  InstrumentMotion(const Script& script, const Bundle& bundle);

  std::vector<Instrument> at(double time_s) const;  // InstrumentPath::at() of each
  const std::vector<InstrumentPath>& paths() const { return paths_; }

 private:
  std::vector<InstrumentPath> paths_;
};

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
